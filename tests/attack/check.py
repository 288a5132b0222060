"""Reads one mutated log and holds the result against the undamaged one."""

from __future__ import annotations

import contextlib
import gc
import os
import re
import resource
import shutil
import traceback
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Loss, Series
from tests.attack.case import EXACT, EXACT_IF_VERIFIED, REPORTED, Base, Case, Mutated, Rows

SECONDS = 20.0
BYTES = 2 * 10**9
PROFILE = Path(__file__).with_name("vessel.toml")
Open = Callable[[Path], Any]


@dataclass(frozen=True)
class Outcome:
    """What came of one case.

    ``result`` is ``"whole"``, ``"loss"`` (fewer messages, or a loss reported) or ``"refused"``, without verification.
    ``overstated`` tells that more messages were reported than there were. ``seconds`` is processor time.
    """

    result: str
    violations: tuple[str, ...]
    seconds: float = 0.0
    memory: int = 0
    overstated: bool = False
    reported: tuple[str, ...] = ()
    """Refusal or losses, with verification."""


@dataclass
class _Found:
    """What one reading returned."""

    series: Mapping[str, Series] = field(default_factory=dict)
    losses: tuple[Loss, ...] = ()
    undecodable: Mapping[str, int] = field(default_factory=dict)
    refusal: str = ""

    @property
    def reported(self) -> tuple[str, ...]:
        """What a user is shown, the first lines of it."""
        losses = [f"{loss.topic or 'any topic'}: {loss.messages} messages, {loss.what}"[:300] for loss in self.losses]
        return tuple([self.refusal[:300]] if self.refusal else losses[:10])


def examine(case: Case, folder: Path, temporary: Path, opener: Open = open_log) -> Outcome:
    """Write the mutated log into an empty folder, read it, and check what must hold.

    Parameters
    ----------
    case
        The case.
    folder
        Where the log is written; removed and made anew.
    temporary
        Folder for temporary files, which must be empty afterwards.
    opener
        In place of `ferryid.ingest.open_log`.
    """
    write(case.mutated, folder)
    for left in temporary.iterdir():
        shutil.rmtree(left, ignore_errors=True)
    before = _listing(folder)
    path = folder / case.base.path
    violations: list[str] = []
    resident = _begin_measuring()
    start = _processor_s()
    result, overstated, reported = "refused", False, ()
    # The command checks nothing of the messages; its own case comes besides.
    for verify in (False, True):
        began = _processor_s()
        found, faults = _guarded(lambda verify=verify: _read(opener, path, case.base, verify))
        if (took := _processor_s() - began) > SECONDS:
            faults.append(f"took {took:.0f} s of processor time")
        if found is not None:
            verdict, problems, over = judge(case, found, verify)
            faults += problems
            overstated = overstated or over
            result, reported = result if verify else verdict, found.reported
        violations += [f"{'with' if verify else 'without'} verification: {fault}" for fault in faults]
    if case.command:
        violations += [f"as a command: {fault}" for fault in _commands(path, temporary.with_name("out"))]
    seconds, memory = _processor_s() - start, max(_peak() - resident, 0)
    if memory > BYTES:
        violations.append(f"took {memory / 1e9:.1f} GB of memory")
    if _listing(folder) != before:
        violations.append("files beside the log were written or changed")
    if any(temporary.iterdir()):
        # A reader that refers to itself goes only now.
        gc.collect()
    if left := sorted(each.name for each in temporary.iterdir()):
        violations.append(f"temporary files were left: {len(left)}")
    return Outcome(result, tuple(dict.fromkeys(violations)), seconds, memory, overstated, reported)


def write(mutated: Mutated, folder: Path) -> None:
    """Write the files of a mutated log into an empty folder."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, content in mutated.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def _guarded(work: Callable[[], Any]) -> tuple[Any, list[str]]:
    """Run, and return the result, or what else than a FerryIdError came out."""
    printed = _Streams()
    faults: list[str] = []
    made = None
    with printed, warnings.catch_warnings():
        warnings.simplefilter("error")
        # The command line turns these off: what cannot be computed is NaN, and is reported where it matters.
        warnings.simplefilter("ignore", RuntimeWarning)
        try:
            made = work()
        except FerryIdError as error:
            line = str(error)
            made = _Found(refusal=line)
            if "\n" in line or "Fix: " not in line:
                faults.append(f"the refusal is not one line with its remedy: {line[:200]!r}")
        except Exception as error:  # noqa: BLE001 - that any other kind comes out is what is looked for
            faults.append(_place(error))
    if printed.text:
        faults.append(f"printed by itself: {printed.text[-300:]!r}")
    return made, faults


def _place(error: Exception) -> str:
    """Name an exception, and the last line of ferryid that it passed."""
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if "/ferryid/" in frame.filename]
    where = f" at {frames[-1].filename.rpartition('/ferryid/')[2]}:{frames[-1].name}" if frames else ""
    text = " ".join(str(error).split())[:120]
    return f"{type(error).__name__}{where}: {text}"


def _read(opener: Open, path: Path, base: Base, verify: bool) -> _Found:
    reader = opener(path)
    wanted = {}
    undecodable = {}
    for topic in reader.topics:
        if not topic.fields and topic.note:
            undecodable[topic.name] = topic.count
            continue
        chosen = [name for name in base.wanted.get(topic.name, ()) if name in topic.fields]
        # What a changed definition lists is decoded too.
        wanted[topic.name] = tuple(chosen or [name for name in topic.fields if not name.endswith("[]")][:3])
    series = reader.read(wanted, verify=verify)
    return _Found(series, tuple(reader.losses), undecodable)


_UNKNOWN: dict[str, frozenset[str]] = {}


def _pattern(what: str) -> str:
    return re.sub(r"\d+", "#", what)


def reported_undamaged(base: Base, folder: Path) -> frozenset[str]:
    """Return what is reported of an undamaged log with an unknown count: that it never was closed, and the like."""
    key = f"{base.format}/{base.name}"
    if key not in _UNKNOWN:
        write(Mutated("", base.files), folder)
        found, faults = _guarded(lambda: _read(open_log, folder / base.path, base, True))
        losses = found.losses if found is not None and not faults else ()
        _UNKNOWN[key] = frozenset(_pattern(loss.what) for loss in losses if loss.messages is None)
    return _UNKNOWN[key]


def judge(case: Case, found: _Found, verify: bool) -> tuple[str, list[str], bool]:
    """Hold what was returned and reported against the undamaged log.

    Returns
    -------
    tuple
        Result, violations, and whether more was reported than there was.
    """
    base, mutated = case.base, case.mutated
    if found.refusal:
        short = "not enough memory" in found.refusal and not mutated.bomb
        faults = [f"refused for memory although it is small: {found.refusal[:200]!r}"] if short else []
        return "refused", faults, False
    faults = []
    returned = {name: len(series.receive_ns) for name, series in found.series.items()}
    total = base.count if mutated.total is None else mutated.total
    reported = sum(loss.messages or 0 for loss in found.losses) + sum(found.undecodable.values())
    usual = frozenset() if mutated.cut else _UNKNOWN.get(f"{base.format}/{base.name}", frozenset())
    unknown = [loss for loss in found.losses if loss.messages is None and _pattern(loss.what) not in usual]
    got = sum(returned.values())
    result = "whole" if got >= total and not reported and not unknown else "loss"
    negative = [loss for loss in found.losses if (loss.messages or 0) < 0]
    if negative:
        faults.append(f"a negative number of messages is reported lost: {negative[0].what[:100]!r}")
    overstated = False
    if mutated.counted:
        if got + reported < total - mutated.missing and not unknown:
            faults.append(f"silent loss: {got} messages returned and {reported} reported of {total}")
        if got > total + mutated.extra:
            faults.append(f"too many: {got} messages returned of {total}")
        overstated = got + reported > total + mutated.extra
    faults += _payload(base, mutated, found, verify)
    if not mutated.legitimate and base.guard in (EXACT, EXACT_IF_VERIFIED) and not faults and base.spans is None:
        faults += _per_topic(base, found, unknown)
    return result, faults, overstated


def _per_topic(base: Base, found: _Found, unknown: list[Loss]) -> list[str]:
    """Count each topic by itself, with the losses that belong to no topic."""
    faults = []
    anywhere = sum(loss.messages or 0 for loss in found.losses if loss.topic not in base.truth)
    for topic, rows in base.truth.items():
        if any(loss.topic in (None, topic) for loss in unknown):
            continue
        got = len(found.series[topic].receive_ns) if topic in found.series else 0
        lost = sum(loss.messages or 0 for loss in found.losses if loss.topic == topic) + anywhere
        if got + lost + found.undecodable.get(topic, 0) < len(rows.times):
            faults.append(f"silent loss on {topic}: {got} returned and {lost} reported of {len(rows.times)}")
    return faults


def _payload(base: Base, mutated: Mutated, found: _Found, verify: bool) -> list[str]:
    """Look for messages returned twice, and for values that a checksum should have caught."""
    faults = []
    covered = not mutated.content and mutated.counted and mutated.total is None and not mutated.extra
    strict = base.guard == EXACT or (base.guard == EXACT_IF_VERIFIED and verify)
    if base.spans is not None:
        covered = covered and _within(base, mutated)
    for topic, series in found.series.items():
        rows = base.truth.get(topic)
        fields = base.wanted.get(topic, ())
        if rows is None or not fields or fields[0] not in series.columns:
            continue
        values = series.columns[fields[0]]
        if values.dtype.kind not in "fiub":
            continue
        pairs = list(zip(series.receive_ns.tolist(), values.tolist(), strict=True))
        if not mutated.extra and mutated.total is None and mutated.counted and _repeated(pairs, rows):
            faults.append(f"a message of {topic} is returned twice")
        known = dict(zip(rows.times.tolist(), rows.values.tolist(), strict=True))
        wrong = [pair for pair in pairs if known.get(pair[0]) != pair[1]]
        if covered and wrong and (strict or (base.guard == REPORTED and not found.losses)):
            faults.append(f"{len(wrong)} messages of {topic} are not those of the undamaged log: {wrong[0]}")
    return faults


def _repeated(pairs: list[tuple[int, float]], rows: Rows) -> bool:
    """Whether a message of the undamaged log is returned more than once (damage may make two others equal)."""
    written = set(zip(rows.times.tolist(), rows.values.tolist(), strict=True))
    counted = [pair for pair in pairs if pair in written]
    return len(counted) > len(set(counted))


def _within(base: Base, mutated: Mutated) -> bool:
    """Whether all that was changed lies in what checksums cover."""
    for name, spans in (base.spans or {}).items():
        old, new = base.files[name], mutated.files.get(name, b"")
        if len(old) != len(new):
            return False
        places = np.flatnonzero(np.frombuffer(old, np.uint8) != np.frombuffer(new, np.uint8))
        inside = np.zeros(len(places), bool)
        for start, end in spans:
            inside |= (places >= start) & (places < end)
        if not inside.all():
            return False
    return True


def _commands(path: Path, out: Path) -> list[str]:
    """Run what ``ferryid inspect`` and ``ferryid ingest`` run."""
    from ferryid.signals.ingest import ingest, render_ingest
    from ferryid.signals.inspect import inspect, render_inspect
    from ferryid.vessel import load_profile

    profile = load_profile(str(PROFILE))
    shutil.rmtree(out, ignore_errors=True)

    def listed() -> None:
        for each in (None, profile):
            render_inspect(inspect(str(path), each, verify=True), 100)

    def ingested() -> None:
        render_ingest(ingest([str(path)], profile, out, progress=lambda text: None))

    faults = _guarded(listed)[1] + _guarded(ingested)[1]
    shutil.rmtree(out, ignore_errors=True)
    return faults


class _Streams:
    """Catches what is written to standard output and error, also by what handles no exceptions."""

    def __enter__(self) -> None:
        self._kept = [os.dup(1), os.dup(2)]
        self._file = os.memfd_create("printed")
        os.dup2(self._file, 1)
        os.dup2(self._file, 2)

    def __exit__(self, *_: object) -> None:
        for number, kept in zip((1, 2), self._kept, strict=True):
            os.dup2(kept, number)
            os.close(kept)
        size = os.lseek(self._file, 0, os.SEEK_END)
        os.lseek(self._file, max(size - 2000, 0), os.SEEK_SET)
        self.text = os.read(self._file, 2000).decode(errors="replace")
        os.close(self._file)


def _listing(folder: Path) -> list[tuple[str, int, int]]:
    found = []
    for each in sorted(folder.rglob("*")):
        about = each.stat()
        found.append((str(each), about.st_size if each.is_file() else 0, about.st_mtime_ns))
    return found


def _processor_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def _begin_measuring() -> int:
    """Let the peak of memory begin at what is used now [bytes], where the system allows it."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return status("VmRSS")


def _peak() -> int:
    return status("VmHWM")


def status(name: str) -> int:
    """Return a line of /proc/self/status [bytes]."""
    with open("/proc/self/status") as file:
        line = next(line for line in file if line.startswith(name + ":"))
    return int(line.split()[1]) * 1024
