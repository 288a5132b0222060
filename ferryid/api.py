"""The public Python API: one call for each command, with its settings as typed arguments and its result as an `Outcome`.

```python
from ferryid import api

fit = api.fit("bag.mcap")
print(fit)              # as the terminal shows it; a notebook shows the report
fit.json["scores"]      # as --json writes it
fit.stored.model        # the model itself
```

The commands call these functions and nothing else. Each raises `ferryid.errors.FerryIdError`, with the file, the cause and
the remedy, for input that cannot be used; nothing half-written is left. Importing this module imports nothing heavy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from ferryid.diagnose import DiagnosisSettings
    from ferryid.draft import Question
    from ferryid.identify import FitSettings
    from ferryid.models import Model
    from ferryid.report.fit_report import FitReport
    from ferryid.report.outcome import Outcome, Report
    from ferryid.types import RunContext
    from ferryid.vessel.choice import VesselChoice
    from ferryid.vessel.profile import Profile

__all__ = [
    "batch",
    "check_vessel",
    "compare",
    "compare_groups",
    "diagnose",
    "doctor",
    "evaluate",
    "export",
    "fit",
    "ingest",
    "inspect",
    "models",
    "new_vessel",
    "plan",
    "promote",
    "prove",
    "reproduce",
    "roll_back",
    "scenarios",
    "show_model",
    "simulate",
    "sweep",
    "vessels",
]

OUT = Path("ferryid-out")
"""The output folder of every call: its ``logs`` keep ingested tables, ``models`` the model store, ``reports`` the pages."""

Logs = str | Path | Sequence[str | Path]
"""Bags, MCAP files, tables or folders; parts of one recording joined by ``+``."""
Ranges = Sequence[tuple[str | float | None, str | float | None]]
"""First and last time of what is used of every log: seconds from its start, negative ones from its end, or clock times in UTC
(``"14:30:05"``, ``"2024-05-17T14:30:05"``), None for the start or the end; all of a log where there is none."""
Progress = Callable[[str], None]
"""Called with the name of each stage, and with an empty one at the end."""


def _quiet(_line: str) -> None:
    """Show nothing."""


def _paths(logs: Logs) -> list[str]:
    """Return logs as paths; those of a URL where their copies are."""
    named = [str(logs)] if isinstance(logs, str | Path) else [str(log) for log in logs]
    if not any("://" in log for log in named):
        return named
    from ferryid.ingest.remote import local_logs

    return [path for log in named for path in local_logs(log)]


def _path(log: str | Path) -> str:
    """Return a single log as a path."""
    paths = _paths(log)
    if len(paths) > 1:
        from ferryid.counts import counted
        from ferryid.errors import FerryIdError

        raise FerryIdError(
            f"{log}: matches {counted(len(paths), 'log')}, one was to be read. Fix: name one, the first is {paths[0]}"
        )
    return paths[0]


def _profile(vessel: str | Path | Profile) -> Profile:
    from ferryid.vessel import load_profile
    from ferryid.vessel.profile import Profile

    return vessel if isinstance(vessel, Profile) else load_profile(str(vessel))


def _told(choice: VesselChoice | None, announce: Progress) -> Profile | None:
    """Return the profile of a choice, and announce it where it was not asked for."""
    if choice is not None and choice.reason:
        announce(choice.reason)
    return None if choice is None else choice.profile


def _chosen(logs: Sequence[str], vessel: str | Path | Profile | None, announce: Progress) -> Profile:
    """Return the vessel of logs, and announce which one was found where it was not asked for."""
    from ferryid.vessel import choose_vessel

    choice = choose_vessel(logs, vessel)
    _told(choice, announce)
    return choice.profile


def _of_archive(out: Path, vessel: str | Path | Profile | None, announce: Progress) -> Profile:
    """Return the vessel whose ingested logs are used, and announce which one was found where it was not asked for."""
    from ferryid.signals.ingested_vessel import ingested_vessel

    if vessel is not None:
        return _profile(vessel)
    choice = ingested_vessel(out)
    _told(choice, announce)
    return choice.profile


def _for_model(
    model: Model, logs: Sequence[str], vessel: str | Path | Profile | None, announce: Progress
) -> Profile | None:
    """Return the profile to read logs with beside a model; None where the model's own serves."""
    from ferryid.vessel import choose_vessel, parse_profile

    own = parse_profile(model.profile_text, model.name)
    choice = choose_vessel(logs, vessel, own=own)
    _told(choice, announce)
    return None if choice.profile is own else choice.profile


def _model(model: str | Path | Model, out: Path) -> Model:
    from ferryid.models import Model
    from ferryid.models.store import load

    return model if isinstance(model, Model) else load(str(model), out)


def _context(
    out: str | Path, progress: Progress, verify: bool = False, ranges: Ranges = (), command: Sequence[str] = ()
) -> RunContext:
    from ferryid.types import RunContext

    return RunContext(Path(out), progress, verify, ranges=tuple(ranges), command=tuple(command))


def _refuse_ranges_of_archive(ranges: Ranges) -> None:
    """Refuse ranges of what is kept as sums."""
    from ferryid.errors import FerryIdError

    if ranges:
        raise FerryIdError(
            "--archive: what is kept of ingested logs is of all of each, so that no range of it can be used. Fix: leave out "
            "--from and --to, give them to ferryid ingest, or name the logs without --archive"
        )


def _outcome(result: Mapping[str, Any], text: str) -> Outcome:
    from ferryid.report.outcome import Outcome

    return Outcome(dict(result), text)


def inspect(
    log: str | Path,
    vessel: str | Path | Profile | None = None,
    *,
    verify: bool = False,
    width: int = 160,
    ranges: Ranges = (),
    announce: Progress = _quiet,
) -> Outcome:
    """Return topics, types, counts, rates, gaps and clocks of a log, and the signals that a vessel's profile finds in it.

    Parameters
    ----------
    log
        Path; parts of one recording joined by ``+``.
    vessel
        Name of a profile, the path of a TOML file, or a profile; what is stated beside the log or in ``$FERRYID_VESSEL`` where
        None, and where nothing is, every profile that has a name is tried.
    verify
        Read the whole file and check every checksum.
    width
        Of the text, in characters.
    announce
        Called with the vessel that is stated.
    """
    from ferryid.signals.inspect import inspect as inspect_log
    from ferryid.signals.inspect import render_inspect
    from ferryid.vessel import stated_choice

    path = _path(log)
    if vessel is not None or ranges:
        profile: Profile | None = _chosen([path], vessel, announce)
    else:
        profile = _told(stated_choice([path]), announce)
    result = inspect_log(path, profile, verify=verify, ranges=tuple(ranges))
    return _outcome(result, render_inspect(result, width))


def ingest(
    logs: Logs,
    vessel: str | Path | Profile | None = None,
    out: str | Path = OUT,
    *,
    verify: bool = False,
    progress: Progress = _quiet,
    ranges: Ranges = (),
    announce: Progress = _quiet,
) -> Outcome:
    """Read logs into Parquet tables with SNAME column names, SI units and provenance."""
    from ferryid.signals.ingest import ingest as ingest_logs
    from ferryid.signals.ingest import render_ingest

    paths = _paths(logs)
    result = ingest_logs(
        paths, _chosen(paths, vessel, announce), Path(out), verify=verify, ranges=tuple(ranges), progress=progress
    )
    return _outcome(result, render_ingest(result))


def fit(
    logs: Logs,
    vessel: str | Path | Profile | None = None,
    settings: FitSettings | None = None,
    out: str | Path = OUT,
    *,
    name: str = "",
    archive: bool = False,
    command: Sequence[str] = (),
    report: bool = True,
    verify: bool = False,
    progress: Progress = _quiet,
    ranges: Ranges = (),
    announce: Progress = _quiet,
) -> FitReport:
    """Fit a model to logs, validate it, store it and write its report.

    Parameters
    ----------
    logs
        What to fit to; with `archive`, which of the ingested logs, all where empty.
    vessel
        Name of a profile, the path of a TOML file, or a profile; found by the logs where None, see
        `ferryid.vessel.choose_vessel`, and with `archive` by what was ingested.
    settings
        How to fit: `ferryid.identify.FitSettings`, its defaults where None.
    out
        Output folder.
    name
        Name of the model in the store; the vessel's where empty.
    archive
        Fit to the sums kept of ingested logs; no log is read.
    command
        The words that the page says it was asked for with.
    report
        Write the page; without it the model alone is stored.
    verify
        Read whole files and check every checksum.
    announce
        Called with the vessel that was found.
    """
    from ferryid.identify import FitSettings
    from ferryid.report.fit_report import fit_and_report, fit_archive_and_report
    from ferryid.report.refusal import shown_where_refused

    settings, run, paths = settings or FitSettings(), _context(out, progress, verify, ranges, command), _paths(logs)
    if archive:
        _refuse_ranges_of_archive(ranges)
        return fit_archive_and_report(
            _of_archive(run.out, vessel, announce), settings, run, paths, name=name, page=report
        )
    profile = _chosen(paths, vessel, announce)
    return shown_where_refused(
        lambda: fit_and_report(paths, profile, settings, run, name=name, page=report),
        "fitted",
        paths,
        profile,
        run,
        command,
    )


def evaluate(
    model: str | Path | Model,
    logs: Logs,
    out: str | Path = OUT,
    *,
    vessel: str | Path | Profile | None = None,
    window_s: float | None = None,
    progress: Progress = _quiet,
    ranges: Ranges = (),
    announce: Progress = _quiet,
) -> Outcome:
    """Judge a model on other logs: mean square of the force errors and R² per axis, errors of free runs.

    `window_s` is the smoothing window of the test data [s], the model's own where None; `vessel` reads logs whose topics are
    not those of the model's profile.
    """
    from ferryid.compare import evaluate as evaluate_model
    from ferryid.report.evaluation_text import render_evaluation

    run, judged, paths = _context(out, progress, ranges=ranges), _model(model, Path(out)), _paths(logs)
    profile = _for_model(judged, paths, vessel, announce)
    result = evaluate_model(judged, paths, run, profile=profile, window_s=window_s)
    return _outcome(result, render_evaluation(result))


def compare(
    models: Sequence[str],
    on: Logs = (),
    out: str | Path = OUT,
    *,
    vessel: str | Path | Profile | None = None,
    window_s: float = 1.0,
    command: Sequence[str] = (),
    progress: Progress = _quiet,
    ranges: Ranges = (),
    announce: Progress = _quiet,
) -> Report:
    """Compare models on the same rows of logs, and by their coefficients; without logs by their coefficients alone.

    Parameters
    ----------
    models
        Each a path, name or name@version.
    on
        Logs.
    out
        Output folder.
    vessel
        In place of the models' own profile.
    window_s
        Smoothing window of the logs [s].
    command
        The words that the page says it was asked for with.
    """
    from ferryid.compare import compare as compare_models
    from ferryid.compare import select_candidates
    from ferryid.models.store import load
    from ferryid.report.comparison_report import report

    run, paths = _context(out, progress, ranges=ranges), _paths(on)
    loaded = [load(name, run.out) for name in models]
    profile = None if vessel is None else _profile(vessel)
    if profile is None and loaded and paths:
        profile = _for_model(loaded[0], paths, None, announce)
    field = select_candidates(models, loaded, profile)
    comparison = compare_models(field, paths, run, window_s=window_s)
    progress("writing the report")
    outcome = report(comparison, run.out, command)
    progress("")
    return outcome


def sweep(
    what: Literal["components", "window", "both", "basis"] | str,
    logs: Logs,
    vessel: str | Path | Profile | None = None,
    settings: FitSettings | None = None,
    out: str | Path = OUT,
    *,
    windows_s: Sequence[float] = (),
    folds: int | None = None,
    archive: bool = False,
    command: Sequence[str] = (),
    progress: Progress = _quiet,
    ranges: Ranges = (),
    announce: Progress = _quiet,
) -> Report:
    """Cross-validate component counts, smoothing windows [s], or bases and structures, and mark which to fit with."""
    from ferryid.identify import FOLDS, FitSettings
    from ferryid.report.structures_report import structures_and_report
    from ferryid.report.sweep_report import sweep_and_report

    paths = _paths(logs)
    if archive:
        _refuse_ranges_of_archive(ranges)
    profile = _of_archive(Path(out), vessel, announce) if archive else _chosen(paths, vessel, announce)
    arguments = (paths, profile, settings or FitSettings(), _context(out, progress, ranges=ranges, command=command))
    given = {"windows_s": windows_s, "folds": FOLDS if folds is None else folds, "archive": archive}
    if what == "basis":
        return structures_and_report(*arguments, **given)  # type: ignore[arg-type]
    return sweep_and_report(what, *arguments, **given)  # type: ignore[arg-type]


def diagnose(
    logs: Logs,
    vessel: str | Path | Profile | None = None,
    out: str | Path = OUT,
    *,
    model: str | None = None,
    settings: DiagnosisSettings | None = None,
    name: str = "",
    command: Sequence[str] = (),
    verify: bool = False,
    progress: Progress = _quiet,
    ranges: Ranges = (),
    announce: Progress = _quiet,
) -> Report:
    """Say which physics a model left out of recordings, what shows it, and store the model that has it.

    Parameters
    ----------
    logs
        Recordings of one vessel.
    vessel
        Its profile; that of `model`, or found by the recordings, where None.
    out
        Output folder.
    model
        The model to examine: path, name or name@version; the profile's hull where None.
    settings
        Against a simulated log, every log by itself, signals to withhold, references: `ferryid.diagnose.DiagnosisSettings`.
        Its model is `model`.
    name
        Name of the model with the findings.
    command
        The words that the page says it was asked for with.
    verify
        Check every checksum of the logs.
    """
    from ferryid.report.diagnosis_report import diagnose_and_report
    from ferryid.report.refusal import shown_where_refused

    paths = _paths(logs)
    profile, examined = _examined(paths, vessel, model, out, settings, announce)
    run = _context(out, progress, verify, ranges)
    outcome = shown_where_refused(
        lambda: diagnose_and_report(paths, profile, examined, run, name=name, command=command),
        "diagnosed",
        paths,
        profile,
        run,
        command,
    )
    progress("")
    return outcome


def compare_groups(
    logs: Logs,
    versus: Logs,
    vessel: str | Path | Profile | None = None,
    out: str | Path = OUT,
    *,
    model: str | None = None,
    settings: DiagnosisSettings | None = None,
    name: str = "",
    command: Sequence[str] = (),
    verify: bool = False,
    progress: Progress = _quiet,
    ranges: Ranges = (),
    announce: Progress = _quiet,
) -> Report:
    """Estimate in which properties and loads two groups of recordings of one vessel differ: ``diagnose LOGS --versus VERSUS``.

    Parameters
    ----------
    logs, versus
        Recordings of the vessel, group A and group B; differences are those of B relative to A.
    vessel, out, model, command, verify
        As of `diagnose`.
    settings
        Signals to withhold; neither ``against`` nor ``each`` goes with two groups.
    name
        Refused where not empty: no model comes of a comparison.
    """
    from ferryid.report.versus_report import compare_and_report

    paths, others = _paths(logs), _paths(versus)
    profile, examined = _examined([*paths, *others], vessel, model, out, settings, announce)
    run = _context(out, progress, verify, ranges)
    outcome = compare_and_report(paths, others, profile, examined, run, name=name, command=command)
    progress("")
    return outcome


def _examined(
    logs: Sequence[str],
    vessel: str | Path | Profile | None,
    model: str | None,
    out: str | Path,
    settings: DiagnosisSettings | None,
    announce: Progress,
) -> tuple[Profile, DiagnosisSettings]:
    """Return the vessel of a diagnosis, and its settings with the model that is examined."""
    from ferryid.diagnose import DiagnosisSettings
    from ferryid.report.diagnosis_report import patient

    if not model:
        vessel = _chosen(logs, vessel, announce)
    elif not vessel:
        vessel = _for_model(_model(model, Path(out)), logs, None, announce)
    profile, examined = patient(vessel, model, Path(out))
    return profile, replace(settings or DiagnosisSettings(), model=examined)


def batch(
    logs: Logs,
    out: str | Path = OUT,
    *,
    vessel: str | None = None,
    recipe: Path | None = None,
    processes: int = 2,
    dask: str | None = None,
    memory_limit: str = "4G",
    again: bool = False,
    progress: Progress = _quiet,
    ranges: Ranges = (),
    tell: Progress = _quiet,
) -> Outcome:
    """Fit, evaluate and diagnose every log of an archive; what is done stays done. See `ferryid.batch.run.batch`."""
    from ferryid.batch.run import batch as run_batch
    from ferryid.batch.run import render_batch

    result = run_batch(
        _paths(logs), Path(out), vessel=vessel, recipe=recipe, processes=processes, dask=dask, memory_limit=memory_limit,
        again=again, ranges=tuple(ranges), progress=progress, tell=tell,
    )  # fmt: skip
    return _outcome(result.to_json(), render_batch(result))


def export(
    what: str | Path,
    out: str | Path = OUT,
    *,
    to: str | None = None,
    file: Path | None = None,
    mcap: Path | None = None,
    model: str | None = None,
    vessel: str | None = None,
    diagnosis: Path | None = None,
    overwrite: bool = False,
    json: Path | None = None,
    progress: Progress = _quiet,
    ranges: Ranges = (),
    announce: Progress = _quiet,
) -> Outcome:
    """Write a model as code or parameters for other programs, or with `mcap` a log and its forces for a viewer.

    See `ferryid.export.commands.export` for the arguments.
    """
    from ferryid.export.commands import export as write_export
    from ferryid.export.commands import render_export

    result = write_export(
        str(what) if mcap is None else _path(what), Path(out), to=to,
        file=file, mcap=mcap, model=model, vessel=vessel, diagnosis=diagnosis,
        overwrite=overwrite, json=json, ranges=tuple(ranges), progress=progress, announce=announce,
    )  # fmt: skip
    progress("")
    return _outcome(result, render_export(result))


def doctor(out: str | Path = OUT) -> Outcome:
    """Return the state of this installation; ``json["problems"]`` is empty where every command can run."""
    from ferryid.doctor import examine, render

    result = examine(Path(out))
    return _outcome(result, render(result))


def models(out: str | Path = OUT) -> Outcome:
    """Return the stored models, and which of each name is current."""
    from ferryid.models.store import list_versions
    from ferryid.report.model_text import render_listing

    result = list_versions(Path(out))
    return _outcome(result, render_listing(result, Path(out)))


def show_model(model: str | Path | Model, out: str | Path = OUT) -> Outcome:
    """Return one model: its coefficients with their intervals, scores and settings."""
    from ferryid.models import model_to_json
    from ferryid.report.model_text import render_model

    loaded = _model(model, Path(out))
    return _outcome(model_to_json(loaded), render_model(loaded))


def promote(
    model: str,
    on: Logs = (),
    out: str | Path = OUT,
    *,
    vessel: str | Path | Profile | None = None,
    force: bool = False,
    progress: Progress = _quiet,
    ranges: Ranges = (),
    announce: Progress = _quiet,
) -> Outcome:
    """Make a stored version the current one, after a replay of it and of the present one on logs; ``json["promoted"]`` tells.

    Parameters
    ----------
    model
        ``name@version``.
    on
        Logs: a version that runs free worse on them than the current one is not promoted, and a rejected one only where it is
        better in something. Without logs an accepted one is.
    out
        Output folder.
    vessel
        In place of the models' own profile.
    force
        Promote whatever the verdict is; the history says so.
    """
    from ferryid.report.promotion import promote_version

    run = _context(out, progress, ranges=ranges)
    paths, profile = _paths(on), None if vessel is None else _profile(vessel)
    if profile is None and paths and "@" in model:
        profile = _for_model(_model(model, run.out), paths, None, announce)
    told = promote_version(model, paths, run, profile, force=force)
    progress("")
    return _outcome(*told)


def roll_back(name: str, out: str | Path = OUT, *, to: int | None = None) -> Outcome:
    """Make the version current that was it before, or an earlier one that was it once."""
    from ferryid.report.promotion import roll_back_version

    return _outcome(*roll_back_version(name, Path(out), to))


def scenarios() -> Outcome:
    """Return the bundled scenarios of the simulator."""
    from ferryid.simulate import render_scenarios, scenario_listing

    listing = scenario_listing()
    return _outcome(listing, render_scenarios(listing))


def simulate(
    scenario: str | Path,
    out: str | Path = OUT,
    *,
    log: Path | None = None,
    storage: str = "sqlite3",
    truth: Path | None = None,
    seed: int | None = None,
    model: str | Path | Model | None = None,
    models: str | Path | None = None,
    conditions: str = "",
    overwrite: bool = False,
    json: Path | None = None,
    progress: Progress = _quiet,
) -> Outcome:
    """Simulate a trial and write a log like a recording. See `ferryid.simulate.commands.run_scenario` for the arguments.

    `models` is the output folder in whose store `model` is looked for, `out` where None.
    """
    from ferryid.simulate import render_simulation, run_scenario

    result = run_scenario(
        str(scenario), Path(out), log=log, storage=storage, truth=truth, seed=seed,
        model=None if model is None else _model(model, Path(models or out)), conditions=conditions, overwrite=overwrite,
        json=json, progress=progress,
    )  # fmt: skip
    return _outcome(result, render_simulation(result))


def vessels() -> Outcome:
    """Return the vessel profiles that have a name: the bundled ones and those in the user's folder for configuration."""
    from ferryid.vessel.choice import named_profiles

    profiles, faulty = named_profiles()
    listed = [{"name": name, "title": one.title, "source": one.source} for name, one in profiles.items()]
    lines = [f"{name:<18} {one.title}" for name, one in profiles.items()]
    lines += [f"{one.name:<18} {one.problem}" for one in faulty]
    return _outcome({"schema": "ferryid.vessels/1", "vessels": listed}, "\n".join(lines))


def check_vessel(file: str | Path, *, identifiable: bool = False, progress: Progress = _quiet) -> Outcome:
    """Return every fault of a vessel profile with its line; ``json["faults"]`` is empty where there is none.

    With `identifiable`, a profile without faults is simulated, and ``json["identifiability"]`` has which effects its sensors
    can distinguish, and what each further sensor adds.
    """
    from ferryid.vessel import check_profile

    faults = check_profile(str(file))
    lines = [f"{file}:{fault.line}: {'warning: ' if fault.warning else ''}{fault.message}" for fault in faults]
    result = {"schema": "ferryid.vessel-check/1", "file": str(file), "faults": [asdict(fault) for fault in faults]}
    text = "\n".join(lines) if lines else f"{file}: no faults"
    if not identifiable or any(not fault.warning for fault in faults):
        return _outcome(result, text)
    from ferryid.identifiability import as_json, as_text, study

    found = study(_profile(file), progress)
    return _outcome({**result, "identifiability": as_json(found)}, f"{text}\n\n{as_text(found)}")


def plan(
    vessel: str | Path | Profile | None = None,
    after: Logs = (),
    out: str | Path = OUT,
    *,
    model: str | None = None,
    minutes: float = 12.0,
    area: tuple[float, float] | None = None,
    separate: Sequence[tuple[str, str]] = (),
    origin: tuple[float, float] | None = None,
    bearing_deg: float = 0.0,
    seed: int = 1,
    name: str = "",
    overwrite: bool = False,
    verify: bool = False,
    ranges: Ranges = (),
    progress: Progress = _quiet,
    announce: Progress = _quiet,
) -> Outcome:
    """Design the trial that would tell most about a vessel, and write it to ``plans/<name>`` of the output folder.

    Parameters
    ----------
    vessel
        Its profile; that of `model`, or found by the recordings, where None.
    after
        What was recorded already: what it tells of the hull counts, and effects that it cannot separate are to be separated.
    model
        The diagnosed model that brings the hull: path, name or name@version; the profile's hull where None.
    minutes
        Longest time of the trial.
    area
        Length and breadth of the water there is [m].
    separate
        Further pairs of effects to separate, as ``("wind", "current")`` or ``("thruster_gain(bow)", "fouling")``.
    origin, bearing_deg
        Latitude and longitude of the middle of the area [deg], for a mission; bearing of its longer side from north [deg].
    seed
        Of the simulated noise.
    name
        Of the plan; the vessel's where empty.
    overwrite
        Replace an earlier plan.
    """
    from ferryid.errors import FerryIdError
    from ferryid.planning import PlanSettings
    from ferryid.report.plan_report import plan_and_report
    from ferryid.vessel import parse_profile

    paths = _paths(after)
    known = _model(model, Path(out)) if model else None
    if known is not None and vessel is None:
        profile = _for_model(known, paths, None, announce) or parse_profile(known.profile_text, known.name)
    elif vessel is None and not paths:
        raise FerryIdError("--vessel: a plan is of a vessel, found none. Fix: give --vessel PROFILE, or --after LOG")
    else:
        profile = _chosen(paths, vessel, announce) if paths else _profile(vessel or "")
    settings = PlanSettings(minutes, area, tuple(separate), known, seed)
    outcome = plan_and_report(
        profile, paths, settings, _context(out, progress, verify, ranges),
        origin=origin, bearing_deg=bearing_deg, name=name, overwrite=overwrite,
    )  # fmt: skip
    progress("")
    return outcome


def new_vessel(
    log: str | Path,
    like: str | Path | Profile | None = None,
    *,
    name: str = "",
    file: str | Path | None = None,
    overwrite: bool = False,
    ask: Callable[[Question], str] | None = None,
    ranges: Ranges = (),
    progress: Progress = _quiet,
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

    result, text, toml = new_profile(
        _path(log), None if like is None else _profile(like), name=name, file=None if file is None else Path(file),
        overwrite=overwrite, ask=ask, ranges=tuple(ranges), progress=progress,
    )  # fmt: skip
    return _outcome({**result, "toml": toml}, text)


def reproduce(
    what: str,
    out: str | Path = OUT,
    *,
    only: Sequence[str] = (),
    repetitions: int = 7,
    processes: int = 2,
    progress: Progress = _quiet,
) -> Outcome:
    """Fly published trials again in the simulator and set the results side by side. See `ferryid.reproduce.run.reproduce`."""
    from ferryid.reproduce.run import render_reproduction
    from ferryid.reproduce.run import reproduce as fly_again

    result = fly_again(what, Path(out), only=only, repetitions=repetitions, processes=processes, progress=progress)
    return _outcome(result, render_reproduction(result))


def prove(
    out: str | Path = OUT,
    *,
    seed: int | None = None,
    runs: float = 1.0,
    only: Sequence[str] = (),
    real: str | None = None,
    vessel: str | None = None,
    processes: int = 1,
    dask: str | None = None,
    progress: Progress = _quiet,
    announce: Progress = _quiet,
) -> Outcome:
    """Inject effects into simulated trials or real recordings, diagnose them blind and score what is found.

    See `ferryid.validation.run.run_validation` for the arguments; `real` and `vessel` are those of
    `ferryid.validation.recorded.evaluators.recorded_pipeline`.
    """
    from ferryid.errors import FerryIdError
    from ferryid.validation import evaluators
    from ferryid.validation.recorded.evaluators import recorded_pipeline
    from ferryid.validation.run import render_summary, run_validation
    from ferryid.vessel import choose_vessel

    if real is None and vessel is not None:
        raise FerryIdError("--vessel: the profile of a real recording, found no --real. Fix: give --real with its log")
    if real is not None and vessel is None and Path(real).suffix.lower() != ".toml":
        choice = choose_vessel([real], None)
        _told(choice, announce)
        vessel = choice.reference
    pipeline = evaluators.pipeline() if real is None else recorded_pipeline(real, vessel)
    result = run_validation(
        Path(out), pipeline, seed=seed, runs=runs, only=only, processes=processes, dask=dask, progress=progress,
        announce=announce,
    )  # fmt: skip
    return _outcome(result, render_summary(result))
