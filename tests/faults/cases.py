"""One fault at one operation, the same command again, and whether the result is that of an undisturbed run."""

from __future__ import annotations

import os
import pickle
import random
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tests.faults import disk
from tests.faults.commands import COMMANDS, contents, differing, fresh, prepare
from tests.faults.system import ERRORS, REMOVALS, Operation, System

FAULTS = (*ERRORS, "KILL", *(f"power: {variant}" for variant in disk.VARIANTS))
LONGEST_S = 60.0


@dataclass(frozen=True)
class Case:
    """A command, a fault, and the number of the operation that it happens at."""

    command: str
    fault: str
    at: int


@dataclass(frozen=True)
class Result:
    """A case and what is wrong with it, an empty text where nothing is."""

    case: Case
    operation: str
    wrong: str


class Bench:
    """Runs cases in forked processes, in which everything is imported and compiled already.

    Parameters
    ----------
    folder
        For logs and results.
    names
        Of the commands.
    """

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        self._folder = folder.resolve()
        self._out = self._folder / "out"
        prepare(self._folder)
        _draw_once()
        self._started: dict[str, Path] = {}
        self._expected: dict[str, dict[str, Any]] = {}
        self.operations: dict[str, list[Operation]] = {}
        for name in names:
            command, before = COMMANDS[name]
            warm = fresh(self._folder / "warm")
            for one in (before, command):
                if one is not None:
                    one(self._folder, warm)
            shutil.rmtree(warm)
            self._started[name] = self._folder / f"start-{name}"
            self._started[name].mkdir()
            if before is not None:
                fresh(self._out).mkdir()
                before(self._folder, self._out)
                fresh(self._started[name])
                self._out.rename(self._started[name])
            self.operations[name] = self._recorded(name)
            self._expected[name] = contents(self._out)

    def cases(self) -> list[Case]:
        """Return every fault at every operation."""
        found = []
        for name, operations in self.operations.items():
            raising = sum(one.kind not in REMOVALS for one in operations)
            for fault in FAULTS:
                found += [Case(name, fault, at) for at in range(raising if fault in ERRORS else len(operations))]
        return found

    def run(self, case: Case) -> Result:
        """Carry out a case."""
        operations = self.operations[case.command]
        among = [one for one in operations if one.kind not in REMOVALS] if case.fault in ERRORS else operations
        what = f"{among[case.at].kind} {among[case.at].path}"
        wrong = ""
        if case.fault.startswith("power"):
            left = disk.after(
                self._started[case.command], operations[: case.at + 1], case.fault.partition(": ")[2], case.at
            )
            disk.write(left, fresh(self._out))
        else:
            self._start(case.command)
            code, told = self._forked(case.command, System(str(self._out), case.fault, case.at))
            allowed = (0, 2) if case.fault in ERRORS else (0, -signal.SIGKILL)
            if code not in allowed:
                wrong = f"ended with code {code}: {told}"
        code, told = self._forked(case.command, None)
        if code != 0:
            wrong = wrong or f"again it ended with code {code}: {told}"
        try:
            different = differing(self._expected[case.command], contents(self._out))
        except Exception as error:  # noqa: BLE001 - whatever cannot be read is a violation
            different = [f"{type(error).__name__}: {error}"]
        if different:
            wrong = wrong or f"differs: {', '.join(different[:4])}"
        return Result(case, what, wrong)

    def _start(self, name: str) -> None:
        shutil.copytree(self._started[name], fresh(self._out))

    def _recorded(self, name: str) -> list[Operation]:
        self._start(name)
        kept = self._folder / "operations"
        code, told = self._forked(name, System(str(self._out)), kept)
        if code != 0:
            raise RuntimeError(f"{name} alone ends with code {code}: {told}")
        found: list[Operation] = pickle.loads(kept.read_bytes())
        seen = {one.path for one in found} | {one.target for one in found}
        at_first = {path.relative_to(self._started[name]).as_posix() for path in self._started[name].rglob("*")}
        for path in self._out.rglob("*"):
            below = path.relative_to(self._out).as_posix()
            # What lies in a folder that was renamed was written under its temporary name.
            if below not in at_first and below not in seen and not any(str(up) in seen for up in Path(below).parents):
                raise RuntimeError(f"{below} was written past the layer")
        return found

    def _forked(self, name: str, system: System | None, keep: Path | None = None) -> tuple[int, str]:
        said = self._folder / "said"
        said.write_text("")
        pid = os.fork()
        if pid == 0:
            code = 1
            try:
                code = _child(COMMANDS[name][0], self._folder, self._out, system, said, keep)
            finally:
                os._exit(code)
        deadline = time.monotonic() + LONGEST_S
        while (ended := os.waitpid(pid, os.WNOHANG))[0] == 0:
            if time.monotonic() > deadline:
                os.kill(pid, signal.SIGKILL)
                said.write_text(f"not done after {LONGEST_S:.0f} s")
            time.sleep(0.002)
        return os.waitstatus_to_exitcode(ended[1]), said.read_text()


def _draw_once() -> None:
    """Keep the pages and figures of fits: to draw them again takes longer than all the rest of a case."""
    from ferryid.files import dump_json
    from ferryid.models.model import model_to_json
    from ferryid.report import page

    kept: dict[str, Any] = {}
    drawn = page.render

    def render(result: Any, *more: Any) -> Any:
        key = dump_json(model_to_json(replace(result.model, created="")))
        if key not in kept:
            kept[key] = drawn(result, *more)
        return kept[key]

    page.render = render


def _child(
    command: Callable[[Path, Path], None], folder: Path, out: Path, system: System | None, said: Path, keep: Path | None
) -> int:
    from ferryid import files
    from ferryid.errors import FerryIdError

    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    files._swept.clear()
    if system is not None:
        system.install()
    code = 0
    try:
        command(folder, out)
    except FerryIdError as error:
        said.write_text(str(error))
        code = 2
    except BaseException:  # noqa: BLE001 - the parent reads it
        said.write_text(traceback.format_exc())
        code = 1
    if keep is not None and system is not None:
        keep.write_bytes(pickle.dumps(system.operations))
    return code


def rows(
    folder: Path, names: Sequence[str] = tuple(COMMANDS), *, sample: int | None = None, seed: int = 0
) -> Iterator[Result]:
    """Yield the results of all cases of some commands, or of a sample of them."""
    bench = Bench(folder, names)
    cases = bench.cases()
    if sample is not None:
        cases = random.Random(seed).sample(cases, min(sample, len(cases)))
    sys.stdout.flush()
    for case in cases:
        yield bench.run(case)
