"""Which fields of a log hold a pose, a heading, a velocity or an angular rate that the profile does not map.

Fields are known by their names, in ROS messages and in tables alike: ``twist.twist.linear.x`` and ``twist_linear_x`` are
one. Orders, errors and what concerns wind or water are left out. Columns without a telling name are tried against the motion.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ferryid.diagnose.data.measurements import WITHHELD
from ferryid.ingest.log import Topic
from ferryid.vessel.field_words import words_of
from ferryid.vessel.profile import Profile
from ferryid.vessel.signal_map import canonical_columns

Kind = str
"""``position``, ``heading``, ``velocity``, ``speed`` (its size), ``yaw_rate``, or ``unknown`` for a column to try."""

_NUMBERS = ("float", "double", "int", "uint", "real")
_ORDERS = {
    *("ref", "reference", "desired", "des", "setpoint", "set", "sp", "target", "goal", "cmd", "command", "commanded"),
    "order",
    *("error", "err", "covariance", "cov", "variance", "std", "accuracy", "dop", "hdop", "offset", "bias", "waypoint"),
    *("simulated", "predicted", "planned"),
}
_OTHER = {
    *("wind", "current", "water", "wave", "waves", "aws", "awa", "tws", "twa", "twd", "stw"),
    *(
        "accel",
        "acceleration",
        "accl",
        "acc",
        "force",
        "torque",
        "wrench",
        "magn",
        "mag",
        "magnetic",
        "field",
        "moment",
    ),
    *(
        "header",
        "seq",
        "stamp",
        "secs",
        "nsecs",
        "sec",
        "nanosec",
        "time",
        "date",
        "status",
        "id",
        "temp",
        "temperature",
    ),
    *(
        "rudder",
        "throttle",
        "thrust",
        "thruster",
        "motor",
        "rpm",
        "pwm",
        "azimuth",
        "propeller",
        "prop",
        "steering",
        "joint",
    ),
    *("dd", "jerk", "altitude", "height", "depth"),
}
_QUATERNION = {"orientation", "rotation", "quaternion"}
_PLACE = {"position", "pos", "translation", "point", "location", "pose"}
_SPEEDS = {"linear", "velocity", "velo", "vel", "twist"}
_RATES = {"angular", "gyro", "gyroscope", "omega", "rates"}
_HEADING = {"heading", "hdg", "yaw", "psi", "compass", "hdt"}
_COURSE = {"course", "cog", "track"}
_SPEED = {"speed", "sog", "spd", "groundspeed"}
_YAW_RATE = {
    *(
        "yawrate",
        "zgyro",
        "gyroz",
        "gz",
        "wz",
        "rot",
        "yawd",
        "psidot",
        "yawdot",
        "yawspeed",
        "rotz",
        "angularvelocityz",
    ),
}
_PAIRS = {
    "position": (
        *(("n", "e"), ("north", "east"), ("northing", "easting"), ("xn", "yn")),
        *(("lat", "lon"), ("latitude", "longitude")),
    ),
    "velocity": (
        *(("u", "v"), ("vx", "vy"), ("vn", "ve"), ("surge", "sway"), ("xbd", "ybd")),
        *(("velx", "vely"), ("vnorth", "veast")),
    ),
}
_SINGLE = "data"
_NOT_TRIED = {
    *("t", "tvec", "z", "roll", "pitch", "phi", "theta", "p", "q", "rolld", "pitchd", "rolldd", "pitchdd", "yawdd"),
    *("xbdd", "ybdd", "xgyro", "ygyro", "supply", "adc", "voltage", "battery", "current", "power", "level"),
}
"""Last words of fields that are known to be something else, which are not tried against the motion."""
UNIT_WORDS = {
    **dict.fromkeys(("deg", "degree", "degrees"), "deg"),
    **dict.fromkeys(("rad", "radian", "radians"), "rad"),
    **dict.fromkeys(("mps", "kn", "kt", "knots", "kmh", "m", "s", "dps", "degps", "radps", "degs", "rads"), ""),
}


@dataclass(frozen=True)
class Candidate:
    """A signal that may be compared with a mapped one.

    Attributes
    ----------
    topic, fields
        Where it is; fields in the order of its kind: x, y (or latitude, longitude; speed, course; x, y, z, w of a quaternion).
    kind
        See `Kind`.
    form
        ``"geodetic"``, ``"polar"``, ``"quaternion"``, or empty.
    """

    topic: str
    fields: tuple[str, ...]
    kind: Kind
    form: str = ""

    @property
    def label(self) -> str:
        """Topic and fields, of a quaternion what its fields have in common."""
        if not self.fields:
            return self.topic
        first = self.fields[0]
        fields = first.removesuffix(first[-1]).rstrip("._ ") if self.form == "quaternion" else ""
        fields = fields or ", ".join(self.fields)
        return fields if self.topic == "table" else self.topic if fields == _SINGLE else f"{self.topic} {fields}"


def candidates(profile: Profile, topics: Sequence[Topic], withhold: Collection[str] = ()) -> tuple[Candidate, ...]:
    """Return what may be compared with mapped signals, that which is known by its name first.

    Parameters
    ----------
    profile
        The vessel; what it maps is no candidate.
    topics
        Of the log, as its index lists them.
    withhold
        Signals that are hidden. Their topics are not looked at; of a table with one of them, only columns that have a telling
        name.
    """
    mapped: dict[str, set[str]] = {}
    hidden: set[str] = set()
    concealed = {column for name in withhold for column in WITHHELD.get(name, ())}
    for signal in profile.signals:
        mapped.setdefault(signal.topic.strip("/"), set()).update(signal.fields)
        if signal.quantity in withhold or concealed & set(canonical_columns(signal)):
            hidden.add(signal.topic.strip("/"))
    known: list[Candidate] = []
    unknown: list[Candidate] = []
    for topic in topics:
        name = topic.name.strip("/")
        table = topic.encoding == "table"
        if topic.count == 0 or (name in hidden and name != "table"):
            continue
        if _barred(words_of(name)):
            continue
        fields = {
            path: words
            for path, kind in topic.fields.items()
            if kind.startswith(_NUMBERS)
            and not path.endswith("]") | _barred(words := words_of(path))
            and path not in mapped.get(name, ())
        }
        named = list(dict.fromkeys(_named(topic, fields)))
        known += named
        used = {path for one in named for path in one.fields}
        # Of message types with many fields, what has no telling name is state of a device.
        if name not in hidden and (
            table or len(topic.fields) <= 1 or not topic.type.startswith(("sensor_msgs", "nav_msgs"))
        ):
            rest = [path for path in fields if path not in used and _to_be_tried(topic, path, fields[path])]
            unknown += [Candidate(topic.name, (path,), "unknown") for path in rest]
    return (*known, *unknown)


def _to_be_tried(topic: Topic, path: str, words: tuple[str, ...]) -> bool:
    """Return whether a field without a telling name may be a measurement: counters, flags and other axes are not."""
    other = bool(_NOT_TRIED & set(words)) or (
        bool(set(words) & (_RATES | _PLACE | _QUATERNION)) and words[-1] in ("x", "y", "w")
    )
    return topic.fields[path].startswith(("float", "double", "real")) and not other


def _barred(words: Collection[str]) -> bool:
    return bool((_ORDERS | _OTHER) & set(words)) or any(word.endswith(("accl", "accel", "magn")) for word in words)


def _named(topic: Topic, fields: Mapping[str, tuple[str, ...]]) -> Iterator[Candidate]:
    """Yield what is known by the names of fields, or of the topic where it has but one."""
    around = set(words_of(topic.name)) if topic.name != "table" else set[str]()
    groups: dict[tuple[str, ...], dict[str, str]] = {}
    scalars: list[Candidate] = []
    for path, words in fields.items():
        kept = [word for word in words if word not in UNIT_WORDS or len(words) == 1 or word == "s"] or list(words)
        groups.setdefault(tuple(kept[:-1]), {}).setdefault(kept[-1], path)
    for stem, axes in groups.items():
        what = set(stem)
        if {"x", "y", "z", "w"} <= axes.keys() and (
            what & _QUATERNION or around & _QUATERNION or not stem or what & _HEADING
        ):
            yield Candidate(topic.name, tuple(axes[axis] for axis in "xyzw"), "heading", "quaternion")
            continue
        if {"x", "y"} <= axes.keys() and what & _PLACE and not what & (_SPEEDS | _RATES):
            yield Candidate(topic.name, (axes["x"], axes["y"]), "position")
        elif {"x", "y"} <= axes.keys() and what & _SPEEDS and not what & _RATES:
            yield Candidate(topic.name, (axes["x"], axes["y"]), "velocity")
        elif {"x", "y"} <= axes.keys() and _is_pose(topic, axes, around):
            yield Candidate(topic.name, (axes["x"], axes["y"]), "position")
        if "z" in axes and what & _RATES and not what & {"position"}:
            yield Candidate(topic.name, (axes["z"],), "yaw_rate")
        for kind, pairs in _PAIRS.items():
            for first, second in pairs:
                if {first, second} <= axes.keys():
                    geodetic = first.startswith("lat")
                    yield Candidate(topic.name, (axes[first], axes[second]), kind, "geodetic" if geodetic else "")
        scalars += _scalars(topic, stem, axes, around)
    courses, speeds = ([one for one in scalars if one.kind == kind] for kind in ("course", "speed"))
    if courses and speeds:
        # A receiver's speed and course over ground are one vector.
        yield Candidate(topic.name, (*speeds[0].fields, *courses[0].fields), "velocity", "polar")
        scalars.remove(speeds[0])
    yield from (one for one in scalars if one.kind != "course")


def _is_pose(topic: Topic, axes: Mapping[str, str], around: set[str]) -> bool:
    return bool({"theta", "psi", "yaw", "heading"} & axes.keys() or around & _PLACE) and not around & (_SPEEDS | _RATES)


def _scalars(topic: Topic, stem: tuple[str, ...], axes: Mapping[str, str], around: set[str]) -> Iterator[Candidate]:
    alone = len(topic.fields) == 1 or set(axes) == {_SINGLE}
    for last, path in axes.items():
        words = {*stem, last} | (around if alone or last == _SINGLE else set())
        turning = bool(words & _HEADING and words & {"rate", "dot", "d"}) or (
            last == "r" and bool({"u", "v"} & axes.keys())
        )
        if last in _YAW_RATE or "".join((*stem, last)) in _YAW_RATE or turning:
            yield Candidate(topic.name, (path,), "yaw_rate")
        elif last in ("x", "y", "z", "w"):
            continue
        elif words & _COURSE:
            yield Candidate(topic.name, (path,), "course")
        elif words & _HEADING or (last == "theta" and {"x", "y"} <= axes.keys() and not {"psi", "phi"} & axes.keys()):
            yield Candidate(topic.name, (path,), "heading")
        elif words & _SPEED and not words & {"angular", "rate", "sound"}:
            yield Candidate(topic.name, (path,), "speed")
