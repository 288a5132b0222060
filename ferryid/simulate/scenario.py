"""Scenarios: TOML files that say what is simulated, read strictly."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib import resources
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.simulate.added_effects import AddedEffect, read_effects
from ferryid.simulate.check_scenario import check_against, disagreements, raise_first
from ferryid.simulate.paths import PATHS, Pose, SetPoints, set_points
from ferryid.simulate.read_section import read_section, section
from ferryid.simulate.sections import (
    Control,
    Current,
    Fouling,
    Guidance,
    Manoeuvre,
    Mooring,
    Payload,
    Sensors,
    Shallow,
    Thrusters,
    Wake,
    Waves,
    Wind,
)
from ferryid.simulate.series import read_series
from ferryid.vessel.faults import Fault, TableReader
from ferryid.vessel.parse_hull import DAMPING_TERMS
from ferryid.vessel.toml_lines import KeyPath, key_lines, line_of, too_deep

__all__ = [
    "Environment",
    "Scenario",
    "check_against",
    "list_scenarios",
    "load_scenario",
    "parse_scenario",
    "read_series",
]

SCHEMA = "ferryid.scenario/1"
MASS = ("m11", "m22", "m23", "m32", "m33")
SHORTEST_DWELL_S = 0.1
LONGEST_S = 14_400.0
"""Longest trial [s]; longer ones would not fit into the memory of a small machine."""
MOST_ROUNDS = 1000
MOST_POSES = 20_000
NOWHERE = SetPoints(((0.0, 0.0, 0.0),), 1.0)
"""The path of a trial without one."""


@dataclass(frozen=True)
class Environment:
    """``[environment]``: everything that comes from outside the vessel."""

    wind: Wind = field(default_factory=Wind)
    current: Current = field(default_factory=Current)
    waves: Waves = field(default_factory=Waves)
    wakes: tuple[Wake, ...] = ()
    shallow: Shallow = field(default_factory=Shallow)
    mooring: Mooring = field(default_factory=Mooring)


@dataclass(frozen=True)
class Scenario:
    """Everything that one simulated trial depends on, apart from the vessel profile it names.

    Attributes
    ----------
    name, title, vessel, seed
        As in the file; `name` is the file's.
    start_ns
        First sample's time since 1970 [ns].
    duration_s
        Length of the trial [s].
    path
        Where the vessel goes; a single pose where a manoeuvre takes the path's place.
    manoeuvre
        Orders straight to the actuators; its `kind` is empty where there is a path.
    guidance, controller, wind, current, waves, wakes, shallow, mooring, payload, fouling, thrusters, sensors
        The sections of the file, see `ferryid.simulate.sections`.
    effects
        The entries of ``[[effects]]``.
    true_hull
        Factors on the true vessel's coefficients (``{"X_u": 1.2}``), which the profile does not know.
    text
        The TOML source.
    folder
        Where the files lie that the scenario names; None for the working directory.
    """

    name: str
    title: str
    vessel: str
    path: SetPoints
    duration_s: float
    start_ns: int
    seed: int
    manoeuvre: Manoeuvre = field(default_factory=Manoeuvre)
    guidance: Guidance = field(default_factory=Guidance)
    controller: Control = field(default_factory=Control)
    wind: Wind = field(default_factory=Wind)
    current: Current = field(default_factory=Current)
    waves: Waves = field(default_factory=Waves)
    wakes: tuple[Wake, ...] = ()
    shallow: Shallow = field(default_factory=Shallow)
    mooring: Mooring = field(default_factory=Mooring)
    payload: tuple[Payload, ...] = ()
    fouling: Fouling = field(default_factory=Fouling)
    thrusters: Thrusters = field(default_factory=Thrusters)
    sensors: Sensors = field(default_factory=Sensors)
    effects: tuple[AddedEffect, ...] = ()
    true_hull: Mapping[str, float] = field(default_factory=dict)
    text: str = ""
    folder: Path | None = None

    @property
    def where(self) -> str:
        """The file as messages name it."""
        return f"{self.name}.toml" if self.folder is None else str(self.folder / f"{self.name}.toml")

    @property
    def profile(self) -> str:
        """The vessel profile as `load_profile` takes it: a bundled name, or a path, from the scenario's folder on first."""
        beside = self.file(self.vessel)
        return str(beside) if self.vessel.endswith(".toml") and beside.is_file() else self.vessel

    @property
    def inputs(self) -> tuple[Path, ...]:
        """The files that the scenario names, its vessel's among them."""
        return Path(self.profile), *(self.file(name) for name in (self.wind.series, self.controller.model) if name)

    def file(self, name: str) -> Path:
        """Return the path of a file that the scenario names, relative to its own folder."""
        return (self.folder or Path()) / name


def check_seed(seed: int) -> None:
    """Refuse a seed that no scenario could have.

    Raises
    ------
    FerryIdError
        When it is negative or longer than TOML's numbers.
    """
    if not 0 <= seed < 2**63:
        raise FerryIdError(
            f"--seed: must be a whole number of at least 0 and less than 2^63, found {seed!r:.40}. Fix: give such a number"
        )


def list_scenarios() -> dict[str, str]:
    """Return the bundled scenarios: name to title, in alphabetical order."""
    return {name: tomllib.loads(_bundled(name))["title"] for name in _names()}


def _names() -> list[str]:
    folder = resources.files("ferryid.simulate.scenarios")
    return sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml"))


def _bundled(name: str) -> str:
    return (resources.files("ferryid.simulate.scenarios") / f"{name}.toml").read_text("utf-8")


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Read a bundled scenario by its name, or a user's own by its path.

    Raises
    ------
    FerryIdError
        When there is no such scenario or file, or the file has a fault; the message gives its line.
    """
    name = str(name_or_path)
    if name in _names():
        return parse_scenario(_bundled(name), f"{name}.toml")
    path = Path(name_or_path)
    if path.suffix != ".toml" and not path.exists():
        raise FerryIdError(
            f"{name}: no scenario of this name, found {', '.join(_names())}."
            f"{did_you_mean(name, _names())} Fix: use one of these or give the path of a TOML file"
        )
    try:
        text = path.read_text("utf-8-sig")
    except OSError as error:
        raise FerryIdError(f"{name}: the scenario cannot be read, {error.strerror}. Fix: check the path") from error
    except UnicodeDecodeError as error:
        raise FerryIdError(f"{name}: the scenario is not UTF-8 text, {error.reason}. Fix: save it as UTF-8") from error
    return parse_scenario(text, name, path.parent)


def parse_scenario(text: str, where: str, folder: Path | None = None) -> Scenario:
    """Read a scenario from its TOML text.

    Parameters
    ----------
    text
        The TOML source.
    where
        Name of the file, for messages.
    folder
        Where the files lie that the scenario names; the working directory where it is left out.

    Raises
    ------
    FerryIdError
        For the first fault, with its line, and the number of further ones.
    """
    try:
        data = tomllib.loads(text)
        deep = too_deep(data)
    # A number of thousands of digits, or thousands of brackets, ends in errors of Python rather than of TOML.
    except (ValueError, RecursionError) as error:
        raise FerryIdError(f"{where}: not valid TOML, {error}. Fix: correct the line") from error
    if deep:
        raise FerryIdError(f"{where}: {deep}")
    return scenario_of(data, text, where, folder)


def scenario_of(data: dict[str, Any], text: str, where: str, folder: Path | None = None) -> Scenario:
    """Read a scenario from its tables; see `parse_scenario`.

    Parameters
    ----------
    data
        The tables, which may hold more than the text does.
    text
        The TOML source, for the lines of faults.
    where, folder
        As in `parse_scenario`.
    """
    lines = key_lines(text)
    faults = [
        Fault(line_of(lines, place), "the number is too long. Fix: write fewer digits") for place in _long(data, ())
    ]
    raise_first(where, faults)
    scenario = _read(TableReader(data, (), lines, faults), Path(where).stem, text, folder)
    faults += [Fault(line_of(lines, place), message) for place, message in disagreements(scenario, data)]
    raise_first(where, faults)
    return scenario


def _long(data: Any, place: KeyPath) -> Iterator[KeyPath]:
    """Yield the places of whole numbers beyond TOML's 64 bits, which Python reads but cannot turn into its floats."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield from _long(value, (*place, key))
    elif isinstance(data, list):
        for index, value in enumerate(data):
            yield from _long(value, (*place, index))
    elif isinstance(data, int) and not -(2**63) <= data < 2**63:
        yield place


def _read(top: TableReader, name: str, text: str, folder: Path | None) -> Scenario:
    top.text("schema", required=True, options=(SCHEMA,))
    title = top.text("title", name)
    vessel = top.text("vessel", required=True)
    seed = top.whole("seed", 0)
    start_ns = _start(top)
    manoeuvre = read_section(section(top, "manoeuvre"), Manoeuvre)
    path = _path(top, moved=top.has("manoeuvre"))
    guidance = read_section(section(top, "guidance"), Guidance)
    environment = read_section(section(top, "environment"), Environment)
    rest = read_section(top, _Rest, close=False)
    scenario = Scenario(
        name=name,
        title=title,
        vessel=vessel,
        path=path,
        duration_s=_duration(top, path, manoeuvre, guidance),
        start_ns=start_ns,
        seed=seed,
        manoeuvre=manoeuvre,
        guidance=guidance,
        effects=read_effects(top),
        true_hull=_true_hull(top),
        text=text,
        folder=folder,
        **vars(environment),
        **vars(rest),
    )
    top.close()
    return scenario


@dataclass(frozen=True)
class _Rest:
    """The sections that stand at the top of the file and need nothing but being read."""

    controller: Control = field(default_factory=Control)
    payload: tuple[Payload, ...] = ()
    fouling: Fouling = field(default_factory=Fouling)
    thrusters: Thrusters = field(default_factory=Thrusters)
    sensors: Sensors = field(default_factory=Sensors)


def _duration(top: TableReader, path: SetPoints, manoeuvre: Manoeuvre, guidance: Guidance) -> float:
    """Return how long the trial takes: what the file says, or else what its path or manoeuvre takes."""
    given = top.has("duration_s")
    usual = manoeuvre.duration_s if manoeuvre.kind else path.duration_s
    duration_s = top.number("duration_s", usual, at_least=1e-3, at_most=LONGEST_S)
    if duration_s > LONGEST_S:
        what, key = ("manoeuvre", "manoeuvre") if manoeuvre.kind else ("path", "path")
        top.fault(f"the {what} takes {duration_s:g} s, at most {LONGEST_S:g} s are simulated. Fix: set duration_s", key)
    if guidance.law != "set-points" and not given and top.has("path"):
        top.fault(
            f'the file lacks "duration_s", which says how long the law "{guidance.law}" follows the path. '
            "Fix: add duration_s = 720 at the top",
            "guidance",
        )
    return duration_s


def _start(top: TableReader) -> int:
    """Return the start of the trial in nanoseconds since 1970."""
    value = top.data.get("start")
    if not top.has("start"):
        return int(datetime(2021, 4, 20, 10, 0, tzinfo=UTC).timestamp()) * 10**9
    if not isinstance(value, datetime):
        top.fault('"start" must be a date and time without quotes. Fix: start = 2021-04-20T10:00:00Z', "start")
        return 0
    moment = value if value.tzinfo else value.replace(tzinfo=UTC)
    if not 2000 <= moment.year < 2100:
        top.fault(f'"start" must lie between 2000 and 2038, found {moment.year}. Fix: choose another year', "start")
        return 0
    return int(moment.timestamp()) * 10**9 + moment.microsecond * 1000


def _path(top: TableReader, *, moved: bool) -> SetPoints:
    """Return the set points of a named path, or of the user's own ``points``; none where a manoeuvre moves the vessel."""
    if moved:
        if top.has("path"):
            top.fault("a trial follows either a path or a manoeuvre, found both. Fix: remove one of them", "manoeuvre")
        return NOWHERE
    table = top.table("path", required=True, needs="which says where the vessel goes (or [manoeuvre], what it does)")
    if table is None:
        return NOWHERE
    kind = table.text("kind", required=True, options=(*PATHS, "points"))
    dwell_s = table.number("dwell_s", 60.0, at_least=SHORTEST_DWELL_S, at_most=LONGEST_S)
    size = table.number("size", 1.0, at_least=1e-3, at_most=1e3)
    rounds = table.whole("rounds", 1, at_least=1)
    if rounds > MOST_ROUNDS:
        table.fault(f'"rounds" must be at most {MOST_ROUNDS}, found {rounds}. Fix: fewer rounds', "rounds")
        rounds = 1
    poses = NOWHERE.poses
    if kind == "points":
        poses = _points(table) or poses
    elif kind:
        poses = PATHS[kind]()
        if table.has("points"):
            table.fault(f'"points" belongs to kind = "points", found kind = "{kind}". Fix: remove one', "points")
    if len(poses) * rounds > MOST_POSES:
        table.fault(f"a path has at most {MOST_POSES} points, found {len(poses) * rounds}. Fix: fewer rounds")
        rounds = 1
    table.close()
    return set_points(poses, dwell_s, size, rounds)


def _points(table: TableReader) -> tuple[Pose, ...]:
    given = table.data.get("points") if table.has("points") else None
    rows = given if isinstance(given, list) else []
    good = bool(rows) and all(isinstance(row, list) and len(row) == 3 for row in rows)
    if not good or not all(type(value) in (int, float) and abs(value) < 1e5 for row in rows for value in row):
        table.fault(
            '"points" must hold rows of [north_m, east_m, heading_deg]. Fix: points = [[10, 0, 0], [10, 5, 90]]',
            "points",
        )
        return ()
    return tuple((float(x), float(y), float(psi)) for x, y, psi in rows)


def _true_hull(top: TableReader) -> dict[str, float]:
    """Return factors on the true hull's coefficients by SNAME name."""
    table = section(top, "true_hull")
    factors: dict[str, Any] = {}
    for name in (*MASS, *DAMPING_TERMS):
        if table.has(name):
            least = 0.1 if name in ("m11", "m22", "m33") else 0.0
            factors[name] = table.number(name, 1.0, at_least=least, at_most=10.0)
    table.close()
    return factors
