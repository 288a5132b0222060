"""Which section of the page on errors explains an error: that of the part of the program in which it arose."""

from __future__ import annotations

from types import TracebackType

from ferryid.errors import FerryIdError

PAGE = "docs/errors.md"
PLACE, OPTION, MEMORY = "a-place-that-cannot-be-written", "an-option-or-argument", "not-enough-memory"
_LOG, _RANGE, _VESSEL, _WHICH = "a-log", "a-range-of-time", "a-vessel-profile", "which-vessel"
_FIT, _MODEL, _DIAGNOSIS, _SCENARIO = "a-fit", "a-stored-model", "a-diagnosis", "a-scenario-or-a-simulation"
_EXPORT, _BATCH, _PROOF, _PLAN = "an-export", "a-batch", "a-proof", "a-plan"
SECTIONS = {
    "batch": _BATCH,
    "cli": OPTION,
    "cli.several": _LOG,
    "compare": _MODEL,
    "diagnose": _DIAGNOSIS,
    "draft": _VESSEL,
    "effects": _DIAGNOSIS,
    "export": _EXPORT,
    "files": PLACE,
    "identifiability": _VESSEL,
    "identify": _FIT,
    "ingest": _LOG,
    "models": _MODEL,
    "planning": _PLAN,
    "regression": _FIT,
    "report": _MODEL,
    "report.plan_report": _PLAN,
    "reproduce": _PROOF,
    "signals": _LOG,
    "signals.time_ranges": _RANGE,
    "simulate": _SCENARIO,
    "simulate.output_paths": PLACE,
    "validation": _PROOF,
    "vessel": _VESSEL,
    "vessel.choice": _WHICH,
    "vessel.folder_settings": OPTION,
}
"""Sections by parts of the program; the longest that fits counts."""


def section(error: BaseException) -> str:
    """Return the section of the page on errors for an error that was raised, by the last module of ferryid on its way.

    One that only adds to another, such as the page on a log that was refused, is explained as the other.
    """
    while isinstance(cause := error.__cause__, FerryIdError) and str(error).startswith(str(cause).rstrip(".")):
        if cause is error:
            break
        error = cause
    name, trace = "", error.__traceback__
    while isinstance(trace, TracebackType):
        module = trace.tb_frame.f_globals.get("__name__", "")
        if module.startswith("ferryid."):
            name = module.removeprefix("ferryid.")
        trace = trace.tb_next
    while name and name not in SECTIONS:
        name = name.rpartition(".")[0]
    return SECTIONS.get(name, OPTION)


def see(where: str) -> str:
    """Return the link that ends the line of an error."""
    return f" ({PAGE}#{where})"
