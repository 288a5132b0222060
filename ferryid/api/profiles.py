"""Vessel profiles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from ferryid.api.arguments import Progress, Ranges, outcome_of, path_of, profile_of, quiet

if TYPE_CHECKING:
    from ferryid.draft import Question, StatedWindow
    from ferryid.report.outcome import Outcome
    from ferryid.vessel.profile import Profile


def vessels() -> Outcome:
    """Return the vessel profiles that have a name: the bundled ones and those in the user's folder for configuration."""
    from ferryid.vessel.choice import named_profiles

    profiles, faulty = named_profiles()
    listed = [{"name": name, "title": one.title, "source": one.source} for name, one in profiles.items()]
    lines = [f"{name:<18} {one.title}" for name, one in profiles.items()]
    lines += [f"{one.name:<18} {one.problem}" for one in faulty]
    return outcome_of({"schema": "ferryid.vessels/1", "vessels": listed}, "\n".join(lines))


def check_vessel(file: str | Path, *, identifiable: bool = False, progress: Progress = quiet) -> Outcome:
    """Return every fault of a vessel profile with its line; ``json["faults"]`` is empty where there is none.

    With `identifiable`, a profile without faults is simulated, and ``json["identifiability"]`` has which effects its sensors
    can distinguish, and what each further sensor adds. ``json["fill_in"]`` is how many lines of a draft are still marked.
    """
    from ferryid.counts import counted, verb
    from ferryid.draft.write import MARK, open_lines
    from ferryid.vessel import check_profile

    faults = check_profile(str(file))
    lines = [f"{file}:{fault.line}: {'warning: ' if fault.warning else ''}{fault.message}" for fault in faults]
    # What may be missing, such as wind areas, is no fault; it is lacking all the same.
    marked = open_lines(Path(file).read_text(encoding="utf-8")) if Path(file).is_file() else 0
    result = {
        "schema": "ferryid.vessel-check/1",
        "file": str(file),
        "fill_in": marked,
        "faults": [asdict(fault) for fault in faults],
    }
    text = "\n".join(lines) if lines else f"{file}: no faults"
    if marked:
        mark = MARK.removeprefix("# ").rstrip(":")
        text += f"\n{counted(marked, 'line')} marked {mark} {verb(marked, 'is')} not used"
    if not identifiable or any(not fault.warning for fault in faults):
        return outcome_of(result, text)
    from ferryid.identifiability import as_json, as_text, study

    found = study(profile_of(file), progress)
    return outcome_of({**result, "identifiability": as_json(found)}, f"{text}\n\n{as_text(found)}")


def new_vessel(
    log: str | Path,
    like: str | Path | Profile | None = None,
    *,
    name: str = "",
    file: str | Path | None = None,
    overwrite: bool = False,
    ask: Callable[[Question], str] | None = None,
    ranges: Ranges = (),
    progress: Progress = quiet,
) -> Outcome:
    """Draft a vessel profile from a log and write it; see `ferryid.draft.new_profile`. The text is ``outcome.json["toml"]``.

    Parameters
    ----------
    log
        Path; parts of one recording joined by ``+``.
    like
        A profile that hull, thrust and the layout of tables are taken from.
    name
        Name of the vessel; of the log's folder where empty.
    file
        Where to; ``vessel.toml`` beside the log where None, nowhere where it is ``-``.
    overwrite
        Replace a file that is there.
    ask
        Called with each `ferryid.draft.Question` that no log answers; what is not answered is a marked line.
    """
    from ferryid.draft import new_profile

    path, used = path_of(log), tuple(ranges)

    def windows(profile: Profile) -> StatedWindow | None:
        return _shorter_windows(path, profile, used)

    result, text, toml = new_profile(
        path, None if like is None else profile_of(like), name=name, file=None if file is None else Path(file),
        overwrite=overwrite, ask=ask, ranges=used, windows=windows, progress=progress,
    )  # fmt: skip
    return outcome_of({**result, "toml": toml}, text)


def _shorter_windows(path: str, profile: Profile, ranges: Ranges) -> StatedWindow | None:
    """Return the windows that a drafted profile is to state as the usual ones average out what the vessel does in the log."""
    from ferryid.draft import StatedWindow
    from ferryid.errors import FerryIdError
    from ferryid.identify import FitSettings
    from ferryid.regression import averaged_out
    from ferryid.signals.prepare import prepare

    try:
        motion = prepare(path, profile, None, window_s=FitSettings().window_s, ranges=tuple(ranges)).motion
    except FerryIdError:
        # What is wrong with the log, or with the draft, the next command says.
        return None
    found = averaged_out(profile, [motion])
    if not found.says:
        return None
    why = f"Windows of {found.usual_s:.3g} s, by its length, over which forces are averaged, keep {found.kept} in this log."
    return StatedWindow(found.window_s, why)
