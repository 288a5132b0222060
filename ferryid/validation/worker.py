"""The process that diagnoses: `python -m ferryid.validation.worker`, which is given logs and profiles and nothing else.

It writes the hash of its sources as one JSON line on standard output, then reads requests as JSON lines on standard input and
writes one JSON line for each. In its folder a log lies alone with the vessel's profile.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from ferryid.errors import FerryIdError, UnwritableError, one_line
from ferryid.side_by_side import keep_to_one_thread
from ferryid.validation.records import Diagnosis
from ferryid.validation.source_hash import source_hash

UNWRITABLE = "unwritable"
"""Key of an answer that is no diagnosis: why what comes of it could not be written."""
RIVALS = 2
"""How many rivals of a finding are kept."""
KEPT = ("effect", "instance", "probability", "parameters", "improvement", "unresolved_with", "says")


def diagnose_log(
    log: Path, profile: Path, out: Path, more: Sequence[Path] = (), before: Sequence[Path] = ()
) -> Diagnosis:
    """Return the diagnosis of one log, or of a campaign; ``refused`` for what cannot be used.

    Parameters
    ----------
    log, profile
        The log, and the TOML file of its vessel.
    out
        Folder for the model that comes of it.
    more
        Further logs, which are a campaign with the first: what most of its logs show is a finding.
    before
        Logs that these are compared with: findings are then what changed between the two groups.

    Raises
    ------
    UnwritableError
        Where the model could not be written.
    """
    from ferryid.diagnose import DiagnosisSettings, compare_groups, diagnose_and_store, to_json, versus_json
    from ferryid.types import RunContext
    from ferryid.vessel import load_profile

    start = time.perf_counter()
    try:
        vessel = load_profile(profile)
        run = RunContext(out, keep_tables=False)
        logs = [str(log), *map(str, more)]
        if before:
            differences = versus_json(compare_groups([*map(str, before)], logs, vessel, DiagnosisSettings(), run))
            return _changes(differences, time.perf_counter() - start)
        found = diagnose_and_store(logs, vessel, DiagnosisSettings(), run)
        seconds = time.perf_counter() - start
        every = [to_json(one) for one in found]
        made = every[0] if len(every) == 1 else _campaign(every)
    except UnwritableError:
        raise
    except FerryIdError as error:
        return Diagnosis("refused", time.perf_counter() - start, error=_within(profile.parent, str(error)))
    return Diagnosis.from_json(
        {name: made[name] for name in ("verdict", "before", "after")}
        | {
            "notes": [_within(profile.parent, note) for note in made["notes"]],
            "seconds": seconds,
            "findings": [_finding(one) for one in made["findings"]],
            "model": None if made["model"] is None else os.path.relpath(made["model"], out),
        }
    )


def _changes(made: Mapping[str, Any], seconds: float) -> Diagnosis:
    """Return what two groups of logs differ in as a diagnosis of the second; what acts in the first has another name."""
    from ferryid.diagnose import GROUPS

    findings = []
    for one in made["differences"]:
        instance = (
            one["instance"] if one["group"] == GROUPS[1] else f"{one['instance'] or 'vessel'}, in group {GROUPS[0]}"
        )
        parameters = {
            name: {key: value for key, value in each.items() if key != "smallest"}
            for name, each in one["parameters"].items()
        }
        findings.append(
            {name: one[name] for name in ("effect", "probability", "unresolved_with", "says")}
            | {"instance": instance, "parameters": parameters, "improvement": {}, "rivals": one["rivals"][:RIVALS]}
            | {"onset": None, "offset": None, "log": 0}
        )
    return Diagnosis.from_json(
        {"verdict": made["verdict"], "seconds": seconds, "findings": findings, "notes": made["notes"]}
    )


def _campaign(every: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the diagnoses of a campaign as one: the findings that most logs have, each from the log of middle probability."""
    found: dict[tuple[str, str | None], list[dict[str, Any]]] = {}
    for number, one in enumerate(every):
        for finding in one["findings"]:
            found.setdefault((finding["effect"], finding["instance"]), []).append(finding | {"log": number})
    shared = [
        sorted(some, key=lambda finding: finding["probability"])[len(some) // 2]
        for some in found.values()
        if 2 * len(some) > len(every)
    ]
    notes = list(dict.fromkeys(note for one in every for note in one["notes"]))
    findings = sorted(shared, key=lambda finding: -finding["probability"])
    return every[0] | {"findings": findings, "notes": notes, "before": {}, "after": {}}


def _finding(one: Mapping[str, Any]) -> dict[str, Any]:
    where = one["where"]
    return {
        **{name: one[name] for name in KEPT},
        "rivals": one["rivals"][:RIVALS],
        "onset": where["onset"],
        "offset": where["offset"],
        "log": one.get("log", 0),
    }


def _within(folder: Path, text: str) -> str:
    """Return a text in which paths lead from the folder of the case: results are published, and tell of no machine."""
    return text.replace(f"{folder}{os.sep}", "")


def main(diagnose: Callable[..., Diagnosis] = diagnose_log) -> None:
    """Answer requests until standard input ends.

    Parameters
    ----------
    diagnose
        Diagnoses one log.
    """
    # An interrupt is for the process that asks, with which this one ends.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # What libraries print must not come between the answers.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    _answer(answers, {"sources": source_hash()})
    keep_to_one_thread()
    for line in iter(_requests(sys.stdin.buffer).get, b""):
        request = json.loads(line)
        log, profile, out = (Path(request[name]) for name in ("log", "profile", "out"))
        start = time.perf_counter()
        try:
            more, before = ([Path(path) for path in request[name]] for name in ("more", "before"))
            others = (more, before) if before else (more,) if more else ()
            answer = diagnose(log, profile, out, *others).to_json()
        except UnwritableError as error:
            answer = {UNWRITABLE: str(error)}
        except Exception as error:  # noqa: BLE001 - a bug that one log shows is reported in its line, and the others go on
            place = traceback.extract_tb(error.__traceback__)[-1]
            bug = one_line(f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})")
            answer = Diagnosis("crashed", time.perf_counter() - start, error=_within(profile.parent, bug)).to_json()
        _answer(answers, answer)


def _answer(stream: BinaryIO, answer: Mapping[str, Any]) -> None:
    stream.write(json.dumps(answer).encode() + b"\n")
    stream.flush()


def _requests(stream: BinaryIO) -> queue.SimpleQueue[bytes]:
    """Return a queue of lines; the process ends at once, also in the middle of a diagnosis, when the one that asks is gone."""
    lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def read() -> None:
        for line in stream:
            lines.put(line)
        os._exit(0)

    threading.Thread(target=read, daemon=True).start()
    return lines


if __name__ == "__main__":
    main()
