"""Scenarios: TOML files that say what is simulated, read strictly."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib import resources
from pathlib import Path
from typing import Any

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.simulate.control import Gains, ReferenceTuning
from ferryid.simulate.paths import PATHS, Pose, SetPoints, set_points
from ferryid.simulate.plant import DAMPING
from ferryid.vessel.faults import Fault, TableReader
from ferryid.vessel.toml_lines import key_lines

SCHEMA = "ferryid.scenario/1"
MASS = ("m11", "m22", "m23", "m32", "m33")
LONGEST_S = 14_400.0
"""Longest trial [s]; longer ones would not fit into the memory of a small machine."""
MOST_ROUNDS = 1000
LARGEST = {
    **dict.fromkeys(("north_mps", "east_mps", "gust_std_mps"), 60.0),
    **dict.fromkeys(("navigation_rate_hz", "thruster_rate_hz", "wind_rate_hz"), 200.0),
    **dict.fromkeys(("imu_rate_hz", "camera_rate_hz"), 1000.0),
    "omega_radps": 20.0,
}
"""Largest value of a key; 1e6 for those not listed. Beyond these no vessel is simulated, only overflow."""


@dataclass(frozen=True)
class Wind:
    """Wind over ground [m/s], where the air goes to, with Ornstein-Uhlenbeck gusts on both components."""

    north_mps: float = 0.0
    east_mps: float = 0.0
    gust_std_mps: float = 0.0
    gust_time_s: float = 8.0


@dataclass(frozen=True)
class Current:
    """Steady current over ground [m/s], where the water goes to."""

    north_mps: float = 0.0
    east_mps: float = 0.0


@dataclass(frozen=True)
class Thrusters:
    """Dynamics of every azimuth thruster: first-order lags and rate limits."""

    speed_lag_s: float = 0.4
    speed_rate_rpmps: float = 600.0
    azimuth_lag_s: float = 0.2
    azimuth_rate_degps: float = 60.0


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the measurements: Aurlien (2021), Table 5.2, then the other sensors.

    `white_share` is the part of the navigation's standard deviations that is white; the rest is coloured.
    """

    position_m: float = 0.02
    heading_deg: float = 0.2
    velocity_mps: float = 0.05
    yaw_rate_degps: float = 0.2
    acceleration_mps2: float = 0.01
    yaw_acceleration_degps2: float = 0.1
    white_share: float = 0.1
    speed_rpm: float = 1.0
    azimuth_deg: float = 0.05
    wind_speed_mps: float = 0.15
    wind_direction_deg: float = 1.5


@dataclass(frozen=True)
class Sensors:
    """Rates, and which unmapped topics fill the log as a real one does. Rate 0 leaves a topic out."""

    navigation_rate_hz: float = 20.0
    thruster_rate_hz: float = 20.0
    wind_rate_hz: float = 0.0
    imu_rate_hz: float = 100.0
    camera_rate_hz: float = 1.0
    clock_offset_ms: float = 0.0


@dataclass(frozen=True)
class Scenario:
    """Everything that one simulated trial depends on, apart from the vessel profile it names.

    `true_hull` holds factors on the true vessel's coefficients (``{"X_u": 1.2}``), which the profile does not know.
    `delta` and `sigma` scale the controller's model, (4.2)-(4.4). `start_ns` is the first sample's time since 1970.
    """

    name: str
    title: str
    vessel: str
    path: SetPoints
    duration_s: float
    start_ns: int
    seed: int
    delta: float = 1.0
    sigma: float = 1.0
    gains: Gains = field(default_factory=Gains)
    reference: ReferenceTuning = field(default_factory=ReferenceTuning)
    wind: Wind = field(default_factory=Wind)
    current: Current = field(default_factory=Current)
    thrusters: Thrusters = field(default_factory=Thrusters)
    sensors: Sensors = field(default_factory=Sensors)
    noise: Noise = field(default_factory=Noise)
    true_hull: Mapping[str, float] = field(default_factory=dict)
    text: str = ""


def list_scenarios() -> dict[str, str]:
    """Return the bundled scenarios: name to title, in alphabetical order."""
    folder = resources.files("ferryid.simulate.scenarios")
    names = sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml"))
    return {name: tomllib.loads((folder / f"{name}.toml").read_text("utf-8"))["title"] for name in names}


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Read a bundled scenario by its name, or a user's own by its path.

    Raises
    ------
    FerryIdError
        When there is no such scenario or file, or the file has a fault; the message gives its line.
    """
    name = str(name_or_path)
    if name in list_scenarios():
        text = (resources.files("ferryid.simulate.scenarios") / f"{name}.toml").read_text("utf-8")
        return parse_scenario(text, f"{name}.toml")
    path = Path(name_or_path)
    if path.suffix != ".toml" and not path.exists():
        raise FerryIdError(
            f"{name}: no scenario of this name, found {', '.join(list_scenarios())}."
            f"{did_you_mean(name, list_scenarios())} Fix: use one of these or give the path of a TOML file"
        )
    try:
        text = path.read_text("utf-8")
    except OSError as error:
        raise FerryIdError(f"{name}: the scenario cannot be read, {error.strerror}. Fix: check the path") from error
    except UnicodeDecodeError as error:
        raise FerryIdError(f"{name}: the scenario is not UTF-8 text, {error.reason}. Fix: save it as UTF-8") from error
    return parse_scenario(text, name)


def parse_scenario(text: str, where: str) -> Scenario:
    """Read a scenario from its TOML text; `where` names it in messages.

    Raises
    ------
    FerryIdError
        For the first fault, with its line, and the number of further ones.
    """
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FerryIdError(f"{where}: not valid TOML, {error}. Fix: correct the line") from error
    faults: list[Fault] = []
    scenario = _read(TableReader(data, (), key_lines(text), faults), Path(where).stem, text)
    if faults:
        first = min(faults, key=lambda fault: fault.line)
        more = f" ({len(faults) - 1} more)" if len(faults) > 1 else ""
        raise FerryIdError(f"{where}:{first.line}: {first.message}{more}")
    return scenario


def _read(top: TableReader, name: str, text: str) -> Scenario:
    top.text("schema", required=True, options=(SCHEMA,))
    title = top.text("title", name)
    vessel = top.text("vessel", required=True)
    seed = top.whole("seed", 0)
    start_ns = _start(top)
    path = _path(top)
    duration_s = top.number("duration_s", path.duration_s, above=0.0, at_most=LONGEST_S)
    if duration_s > LONGEST_S:
        top.fault(
            f"the path takes {duration_s:g} s, at most {LONGEST_S:g} s are simulated. Fix: set duration_s", "path"
        )
    controller = _section(top, "controller")
    delta = controller.number("delta", 1.0, at_least=0.0, at_most=10.0)
    sigma = controller.number("sigma", 1.0, at_least=0.0, at_most=10.0)
    gains = Gains(**_triples(controller, Gains()))
    reference = _section(controller, "reference")
    tuning = ReferenceTuning(**_triples(reference, ReferenceTuning()))
    environment = _section(top, "environment")
    wind = _section(environment, "wind")
    current = _section(environment, "current")
    sensors = _section(top, "sensors")
    noise = _section(sensors, "noise")
    thrusters = _section(top, "thrusters")
    scenario = Scenario(
        name=name,
        title=title,
        vessel=vessel,
        path=path,
        duration_s=duration_s,
        start_ns=start_ns,
        seed=seed,
        delta=delta,
        sigma=sigma,
        gains=gains,
        reference=tuning,
        wind=Wind(**_numbers(wind, Wind(), positive=("gust_time_s",), any_sign=("north_mps", "east_mps"))),
        current=Current(**_numbers(current, Current(), any_sign=("north_mps", "east_mps"))),
        thrusters=Thrusters(**_numbers(thrusters, Thrusters(), positive=("speed_rate_rpmps", "azimuth_rate_degps"))),
        sensors=Sensors(
            **_numbers(
                sensors,
                Sensors(),
                positive=("navigation_rate_hz", "thruster_rate_hz"),
                any_sign=("clock_offset_ms",),
            )
        ),
        noise=Noise(**_numbers(noise, Noise())),
        true_hull=_true_hull(top),
        text=text,
    )
    if scenario.noise.white_share > 1.0:
        noise.fault('"white_share" must be at most 1', "white_share")
    for table in (wind, current, environment, reference, controller, noise, sensors, thrusters, top):
        table.close()
    return scenario


def _section(parent: TableReader, key: str) -> TableReader:
    """Return a table that may be left out, as an empty one then."""
    table = parent.table(key)
    return TableReader({}, (*parent.path, key), {}, []) if table is None else table


def _numbers(
    table: TableReader, defaults: Any, positive: tuple[str, ...] = (), any_sign: tuple[str, ...] = ()
) -> dict[str, float]:
    """Read one number per field of a dataclass: above zero, of any sign, or else at least zero."""
    values = {}
    for key, default in vars(defaults).items():
        largest = LARGEST.get(key, 1e6)
        if key in any_sign:
            values[key] = table.number(key, default, at_least=-largest, at_most=largest)
        elif key in positive:
            values[key] = table.number(key, default, above=0.0, at_most=largest)
        else:
            values[key] = table.number(key, default, at_least=0.0, at_most=largest)
    return values


def _triples(table: TableReader, defaults: Any) -> dict[str, Any]:
    """Read three non-negative numbers per field of a dataclass: north, east and heading."""
    values = {}
    for key, default in vars(defaults).items():
        given = table.numbers(key, 3)
        largest = LARGEST.get(key, 1e6)
        if given and not all(0.0 <= value <= largest for value in given):
            table.fault(f'"{key}" must hold numbers of at least 0 and at most {largest:g}', key)
        values[key] = given or default
    return values


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
        top.fault(f'"start" must lie between 2000 and 2100, found {moment.year}', "start")
        return 0
    return int(moment.timestamp()) * 10**9 + moment.microsecond * 1000


def _path(top: TableReader) -> SetPoints:
    """Return the set points of a named path, or of the user's own ``points``."""
    table = top.table("path", required=True, needs="which says where the vessel goes")
    if table is None:
        return SetPoints(((0.0, 0.0, 0.0),), 1.0)
    kind = table.text("kind", required=True, options=(*PATHS, "points"))
    dwell_s = table.number("dwell_s", 60.0, above=0.0, at_most=LONGEST_S)
    size = table.number("size", 1.0, above=0.0, at_most=1e3)
    rounds = table.whole("rounds", 1, at_least=1)
    if rounds > MOST_ROUNDS:
        table.fault(f'"rounds" must be at most {MOST_ROUNDS}, found {rounds}', "rounds")
        rounds = 1
    poses: tuple[Pose, ...] = ((0.0, 0.0, 0.0),)
    if kind == "points":
        poses = _points(table) or poses
    elif kind:
        poses = PATHS[kind]()
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
    table = _section(top, "true_hull")
    factors = {}
    for name in (*MASS, *DAMPING):
        if table.has(name):
            factors[name] = table.number(
                name, 1.0, at_least=0.1 if name in ("m11", "m22", "m33") else 0.0, at_most=10.0
            )
    table.close()
    return factors
