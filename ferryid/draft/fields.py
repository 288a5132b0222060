"""Which fields of a log may be pose, velocity, heading, rates, wind and actuators, by their names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from ferryid.ingest.log import Topic
from ferryid.vessel.field_words import words_of

_NUMBERS = ("float", "double", "int", "uint", "real")
ORDERS = frozenset(
    {
        "ref",
        "reference",
        "desired",
        "des",
        "setpoint",
        "set",
        "sp",
        "target",
        "goal",
        "cmd",
        "command",
        "commanded",
        "order",
        "input",
    }
)
_NO_MEASUREMENT = frozenset(
    [
        "error",
        "err",
        "covariance",
        "cov",
        "variance",
        "std",
        "accuracy",
        "dop",
        "hdop",
        "offset",
        "bias",
        "waypoint",
        "simulated",
        "predicted",
        "planned",
        "header",
        "seq",
        "stamp",
        "secs",
        "nsecs",
        "sec",
        "nanosec",
        "date",
        "status",
        "id",
        "temp",
        "temperature",
        "accel",
        "acceleration",
        "accl",
        "acc",
        "magn",
        "mag",
        "magnetic",
        "field",
        "jerk",
        "altitude",
        "height",
        "camera",
        "image",
        "battery",
        "power",
        "voltage",
        "supply",
        "current",
        "water",
        "wave",
        "waves",
        "payload",
        "weather",
    ]
)
PLACE = frozenset({"position", "pos", "translation", "point", "location", "pose", "odom", "odometry", "place"})
SPEEDS = frozenset({"linear", "velocity", "velo", "vel", "twist", "speed", "velocities"})
RATES = frozenset(
    [
        "angular",
        "gyro",
        "gyr",
        "gyroscope",
        "omega",
        "rates",
        "angvelo",
        "rate",
        "angvel",
        "yawrate",
        "zgyro",
        "rotational",
    ]
)
HEADING = frozenset({"heading", "hdg", "yaw", "psi", "compass", "hdt", "cap"})
_GEODETIC = (("latitude", "longitude"), ("lat", "lon"), ("lat", "lng"), ("lat", "long"))
_AHEAD = SPEEDS | {"u", "surge", "spd", "sog", "stw"}
_OF_A_SPEED = frozenset({"water", "field"})
"""Words of what is no pose or velocity that the name of a speed has all the same: through the water, the field of a message."""
_ASIDE = frozenset({"y", "z"})
_OTHER_SPEEDS = frozenset({"wind", "air", "vertical", "down", "heave", "sway", "turn"})
_QUATERNION = frozenset({"orientation", "rotation", "quaternion", "quat", "q", "heading", "attitude"})
_PARTS_OF_QUATERNION = {f"q{one}": ("q", one) for one in "xyzw"}
"""Words that name a part of a quaternion, as two."""
_ANGLES = frozenset({"orientation", "attitude", "euler", "rpy"})
"""What three numbers are roll, pitch and heading of."""
_PRESENT = frozenset({*_ANGLES, "rotational", "angular", "yaw", "psi", "pose", "position", "lat", "lon"})
"""What a current of the water or of a battery has none of: before these words it says that the value is the present one."""
_WORLD_AXES = (("n", "e"), ("north", "east"))
_OF_THREE = (("1", "2", "3"), ("0", "1", "2"))
"""Numbers of the three parts of a vector."""
ACTUATORS = frozenset(
    [
        "thruster",
        "thrusters",
        "motor",
        "propeller",
        "prop",
        "rudder",
        "azimuth",
        "azi",
        "rpm",
        "pwm",
        "lpwm",
        "rpwm",
        "throttle",
        "thrust",
        "actuator",
        "actuators",
        "esc",
        "steering",
        "nozzle",
        "pod",
        "delta",
        "servo",
        "outboard",
        "engine",
    ]
)
_UNIT_WORDS = frozenset(
    {"deg", "degrees", "rad", "m", "meters", "mps", "kn", "kt", "kts", "knots", "rads", "radps", "degps"}
)
_PAIRS: Mapping[str, tuple[tuple[str, str], ...]] = {
    "position": (("n", "e"), ("north", "east"), ("northing", "easting"), ("xn", "yn"), ("pn", "pe")),
    "velocity": (
        ("u", "v"),
        ("u", "vm"),
        ("vx", "vy"),
        ("vn", "ve"),
        ("surge", "sway"),
        ("velx", "vely"),
        ("vnorth", "veast"),
    ),
}


@dataclass(frozen=True)
class FieldGroup:
    """Fields of one topic that may be one quantity.

    Attributes
    ----------
    kind
        ``position``, ``heading``, ``velocity`` or ``yaw_rate``.
    topic, fields
        Where it is.
    form
        ``geodetic`` (latitude first), ``quaternion``, or empty.
    rate_hz
        Messages per second, of the whole log.
    frame
        The frame that the log's format states, empty where it states none.
    lasts_s
        From the first message to the last [s].
    usual_frame, usual_by
        The frame of the topic where nothing in the log decides, and whose it is; empty for NED.
    """

    kind: str
    topic: str
    fields: tuple[str, ...]
    form: str = ""
    rate_hz: float = 0.0
    frame: str = ""
    lasts_s: float = 0.0
    usual_frame: str = ""
    usual_by: str = ""

    @property
    def named_frame(self) -> str:
        """The frame of a world that the names of a velocity's components state, or an empty string."""
        last = tuple(words_of(path)[-1] for path in self.fields)
        return "NED" if last in (("vn", "ve"), ("vnorth", "veast"), *_WORLD_AXES) else ""

    @property
    def label(self) -> str:
        """Topic and fields."""
        return f"{self.topic}: {', '.join(self.fields)}"


def numeric_fields(topic: Topic) -> dict[str, tuple[str, ...]]:
    """Return the numbers of a topic with the words of their names."""
    found = {}
    for path, kind in topic.fields.items():
        # Of most messages these are arrays.
        if kind.startswith(_NUMBERS) and (topic.lists_elements or not path.endswith("]")):
            found[path] = words_of(path)
    return found


def speeds_ahead(topics: Sequence[Topic]) -> list[tuple[str, str]]:
    """Return topic and field of what may be the speed ahead by its name, those with the fewest other words first."""
    others = ORDERS | RATES | HEADING | ACTUATORS | (_NO_MEASUREMENT - _OF_A_SPEED) | _OTHER_SPEEDS
    found = [
        (len(set(words) - _AHEAD), topic.name, path)
        for topic in topics
        for path, words in numeric_fields(topic).items()
        if _AHEAD & set(words) and not others & set(words) and words[-1] not in _ASIDE
    ]
    return [(topic, path) for _, topic, path in sorted(found, key=lambda one: one[0])]


def span_of(topic: Topic) -> float:
    """Return the time from the first message of a topic to its last [s]; 0 where it is not known."""
    if topic.start_ns is None or topic.end_ns is None:
        return 0.0
    return max(topic.end_ns - topic.start_ns, 0) * 1e-9


def rate_of(topic: Topic) -> float:
    """Return messages per second of a topic; 0 where it has no length."""
    span_s = span_of(topic)
    return (topic.count - 1) / span_s if span_s > 0.0 else 0.0


def navigation_groups(topics: Sequence[Topic]) -> list[FieldGroup]:
    """Return what may be the vessel's own pose, heading, velocity and yaw rate; orders, errors and devices are none."""
    found: list[FieldGroup] = []
    for topic in topics:
        around = set(words_of(topic.name)) if topic.name != "table" else set[str]()
        if topic.count < 2 or around & (ORDERS | _NO_MEASUREMENT | ACTUATORS) or "wind" in around:
            continue
        fields = {
            path: words
            for path, words in ((path, _present(words)) for path, words in numeric_fields(topic).items())
            if not set(words) & (ORDERS | _NO_MEASUREMENT | ACTUATORS | {"wind", "wrench", "force", "torque"})
        }
        found += _of_topic(topic, around, fields)
    return found


def _present(words: tuple[str, ...]) -> tuple[str, ...]:
    """Return the words of a name without one that says no more than that the value is the present one."""
    return words[1:] if words[:1] == ("current",) and set(words[1:]) & _PRESENT else words


def _of_topic(topic: Topic, around: set[str], fields: Mapping[str, tuple[str, ...]]) -> list[FieldGroup]:
    groups: dict[tuple[str, ...], dict[str, str]] = {}
    for path, words in fields.items():
        axis, stem = _axis((*words[:-1], *_PARTS_OF_QUATERNION.get(words[-1], words[-1:])) if words else words)
        groups.setdefault(stem, {}).setdefault(axis, path)
    # Columns of a table share no stem: what names the axes of one vector lies in several.
    table = topic.encoding == "table"
    # The shortest name of an axis is that of the quantity itself, not of its derivative or difference.
    longest_first = sorted(groups.items(), key=lambda one: -len(one[0]))
    every = {axis: path for _, axes in longest_first for axis, path in reversed(axes.items())}
    found: list[tuple[str, tuple[str, ...], str]] = []
    for stem, axes in groups.items():
        what = set(stem) | around
        if {"x", "y", "z", "w"} <= axes.keys() and what & _QUATERNION:
            found.append(("heading", tuple(axes[one] for one in "xyzw"), "quaternion"))
            continue
        third = next((axes[three[2]] for three in _OF_THREE if axes.keys() == set(three)), None)
        if third is not None and set(stem) & (RATES | _ANGLES):
            found.append(("yaw_rate" if set(stem) & RATES else "heading", (third,), ""))
        found += _vectors(topic, what, set(stem), axes)
    slow = {
        axis: path
        for _, axes in longest_first
        for axis, path in reversed(axes.items())
        if not set(fields[path]) & SPEEDS
    }
    for kind, pairs in _PAIRS.items():
        for first, second in pairs:
            # North and east of a velocity are no position.
            axes_of = slow if kind == "position" else every
            if {first, second} <= axes_of.keys():
                found.append((kind, (axes_of[first], axes_of[second]), ""))
    for names in _GEODETIC:
        if set(names) <= every.keys():
            found.append(("position", (every[names[0]], every[names[1]]), "geodetic"))
            break
    alone = len(fields) == 1
    plane = any(set(two) <= every.keys() for two in (("x", "y"), *_GEODETIC))
    for path, words in fields.items():
        said = set(words) | (around if alone else set())
        if said & HEADING and set(words) & SPEEDS:
            found.append(("yaw_rate", (path,), ""))
        elif (said & HEADING and not said & RATES and words[-1] not in ("x", "y", "z", "w", "d", "dot", "rate")) or (
            words[-1] == "theta" and plane and not {"psi", "yaw", "phi"} & every.keys()
        ):
            found.append(("heading", (path,), ""))
        elif (said & RATES and (said & HEADING or words[0] in ("r", "z") or "zgyro" in said)) or words == ("r",):
            found.append(("yaw_rate", (path,), ""))
    bare = {words[0]: path for path, words in fields.items() if len(words) == 1}
    if table and {"x", "y"} <= bare.keys() and not any(kind == "position" for kind, _, _ in found):
        found.append(("position", (bare["x"], bare["y"]), ""))
    rate, span_s = rate_of(topic), span_of(topic)
    return [
        FieldGroup(kind, topic.name, paths, form, rate, lasts_s=span_s) for kind, paths, form in dict.fromkeys(found)
    ]


def _vectors(
    topic: Topic, what: set[str], stem: set[str], axes: Mapping[str, str]
) -> Iterable[tuple[str, tuple[str, ...], str]]:
    """Yield what the axes x, y, z under one stem may be."""
    for north, east in _WORLD_AXES:
        if {north, east} <= axes.keys() and stem & SPEEDS and not stem & RATES:
            yield "velocity", (axes[north], axes[east]), ""
    if not {"x", "y"} <= axes.keys():
        if "z" in axes and what & RATES:
            yield "yaw_rate", (axes["z"],), ""
        return
    if stem & RATES:
        if "z" in axes:
            yield "yaw_rate", (axes["z"],), ""
    elif stem & SPEEDS or (what & SPEEDS and not stem & PLACE):
        yield "velocity", (axes["x"], axes["y"]), ""
        # A vector of three that names no angular part may hold the yaw rate in its third place: motion decides.
        if "z" in axes and not any(set(words_of(path)) & RATES for path in topic.fields):
            yield "yaw_rate", (axes["z"],), ""
    elif what & PLACE or {"theta", "psi", "yaw"} & axes.keys():
        yield "position", (axes["x"], axes["y"]), ""


def _axis(words: tuple[str, ...]) -> tuple[str, tuple[str, ...]]:
    """Return the word that names an axis, the last but for units or else the first, and the others."""
    short = {"x", "y", "z", "w", "n", "e", "u", "v", "r", "vm", "psi", "theta", "surge", "sway"}
    while len(words) > 1 and words[-1] in _UNIT_WORDS:
        words = words[:-1]
    if (words and words[-1] in short) or len(words) < 2:
        return (words[-1] if words else ""), words[:-1]
    if words[0] in short:
        return words[0], words[1:]
    return words[-1], words[:-1]
