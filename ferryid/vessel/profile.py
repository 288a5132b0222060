"""The vessel profile: hull, actuators, wind areas and where the signals live in a log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf, isfinite, nan

from ferryid.ingest.log import TableLayout
from ferryid.types import Floats


@dataclass(frozen=True)
class Hull:
    """Three-degree-of-freedom hull in SNAME notation, SI units, FRD body frame.

    Attributes
    ----------
    length_m, beam_m, draught_m
        Main dimensions [m], NaN where not stated.
    mass_kg
        Rigid-body mass [kg].
    inertia_z
        Rigid-body moment of inertia in yaw about the body origin [kg·m²].
    x_g_m
        Centre of gravity forward of the body origin [m].
    M
        Total mass matrix M_RB + M_A, shape (3, 3) [kg, kg·m, kg·m²]. Rigid-body mass alone where no model is known.
    D
        Damping coefficients by SNAME name (``"X_u"``, ``"X_|u|u"``, ``"Y_vvv"`` ...), negative where they damp; empty
        where no hull model is known.
    spread
        Standard deviation by which the coefficients of M and D are believed to be off, as a share of each; infinite where
        the profile says that it is unknown, NaN where it says nothing.
    """

    length_m: float
    beam_m: float
    draught_m: float
    mass_kg: float
    inertia_z: float
    x_g_m: float
    M: Floats
    D: Mapping[str, float]
    spread: float = nan

    @property
    def has_model(self) -> bool:
        """True where damping coefficients are stated, not rigid-body mass alone."""
        return bool(self.D)

    @property
    def is_known(self) -> bool:
        """True where there is a hull model that estimates may lean on: one whose spread is not unknown."""
        return not self.why_unknown

    @property
    def why_unknown(self) -> str:
        """Why estimates cannot lean on a hull model, as the end of a sentence; empty where they can."""
        if not self.has_model:
            return "the profile has no hull model"
        return "the profile says that the spread of its hull model is unknown" if self.spread == inf else ""


@dataclass(frozen=True)
class ThrustCurve:
    """Force of one propeller [N] over its speed; `kind` is ``polynomial``, ``table``, ``quadratic`` or ``open_water``.

    ``input_unit`` is ``rpm`` or ``rps``; `valid` is the range of the input outside which it is clipped, and counted.
    `coefficients` start with that of the first power. `table` holds speeds and forces, or J and K_T for ``open_water``.
    `ahead` and `astern` are N per (input unit)²; for ``open_water`` `astern` is K_T with the propeller reversed.
    """

    kind: str
    input_unit: str
    valid: tuple[float, float]
    coefficients: tuple[float, ...] = ()
    table: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    ahead: float = 0.0
    astern: float = 0.0


@dataclass(frozen=True)
class Actuator:
    """One actuator at `position_m` (x forward, y starboard of the body origin) [m].

    `kind`: ``azimuth``, ``propeller``, ``propeller_rudder``, ``tunnel`` or ``force``. `angle_rad` is the fixed
    direction of a ``propeller`` or ``force`` (0 ahead, π/2 starboard). `count` units driven as one act at `position_m`.
    """

    name: str
    kind: str
    position_m: tuple[float, float]
    thrust: ThrustCurve | None = None
    angle_rad: float = 0.0
    count: int = 1
    rudder: Mapping[str, float] = field(default_factory=dict)
    inflow: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class WindAreas:
    """Wind load parameters of Blendermann's form (thesis Table 4.2); areas [m²], lengths [m]."""

    frontal_m2: float
    lateral_m2: float
    length_m: float
    S_L_m: float
    CD_t: float
    CD_l_AF: float
    delta: float


Element = tuple[str, str | float]
"""The array of names in a message (``"name[]"``), and the name of the entry that is meant."""


@dataclass(frozen=True)
class Signal:
    """One entry of the signal map: the fields of one topic that give one canonical quantity.

    `quantity` is the key in the file (``position``, ``heading``, ``velocity``, ``yaw_rate``, ``wind``, ``payload`` or
    ``<actuator>.<speed|angle|rudder|force|thrust>`` with ``.command`` appended for orders); `line` is its line there.
    A scalar is ``sign * value + offset`` in `unit`; velocity and yaw rate are multiplied by `scale`. A speed, force or
    angle in ``%``, ``fraction`` or ``us`` is a share of `full` [rpm, N, rad]; `pulse_us` are the pulses of full astern,
    neutral and full ahead, and the dead band [us]. `mount_m` is where an antenna or a log sits, or a payload whose place is
    not measured (x forward, y starboard of the body origin) [m]. On a topic of several signals `where` chooses its messages:
    fields and their values. In an array whose entries have names, `element` is the array of names and the signal's own.
    The actuator follows an order by a first-order lag of `time_constant_s`, `delay_s` late; NaN where that is not stated.
    """

    quantity: str
    topic: str
    fields: tuple[str, ...]
    unit: str
    frame: str = ""
    sign: float = 1.0
    offset: float = 0.0
    options: Mapping[str, str] = field(default_factory=dict)
    required: bool = True
    line: int = 0
    full: float = 0.0
    mount_m: tuple[float, float] = (0.0, 0.0)
    where: tuple[tuple[str, float], ...] = ()
    pulse_us: tuple[float, float, float, float] | None = None
    scale: float = 1.0
    element: Element | None = None
    time_constant_s: float = nan
    delay_s: float = nan

    @property
    def is_order(self) -> bool:
        """Whether it is what an actuator was ordered, rather than what was measured."""
        return self.quantity.endswith(".command")

    @property
    def states_response(self) -> bool:
        """Whether the profile states how the actuator follows this order."""
        return isfinite(self.time_constant_s) or isfinite(self.delay_s)


SETTINGS = ("tank", "pond", "harbour", "sea")
"""Where logs may be recorded: a towing tank or pool indoors, a pond, sheltered and open water."""


@dataclass(frozen=True)
class Profile:
    """A vessel and where its signals live in a log; read from one TOML file by `ferryid.vessel.load_profile`.

    `text` is the TOML source, which a model file embeds; `sha256` is its hash. `setting` is one of `SETTINGS`: where the logs
    were recorded; empty where that is not known. `window_s` is the length of the windows in which forces are averaged [s]; NaN
    where it follows from the vessel's length.
    """

    name: str
    title: str
    source: str
    hull: Hull
    actuators: tuple[Actuator, ...]
    wind: WindAreas | None
    signals: tuple[Signal, ...]
    table: TableLayout | None
    path: str
    text: str
    sha256: str
    setting: str = ""
    window_s: float = nan

    @property
    def measures_sway(self) -> bool:
        """False where the velocity has one field: surge alone is measured, and sway is taken as zero."""
        return all(len(signal.fields) > 1 for signal in self.signals if signal.quantity == "velocity")
