"""The true vessels: what a yard would know of them. Lengths [m], masses [kg], SI throughout; body axes FRD, origin midship
on the waterline."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

RHO = 1025.0
GRAVITY = 9.81


@dataclass(frozen=True)
class Thruster:
    """One thruster at ``x, y, z`` [m]; `angle_deg` is None where it turns, and its fixed direction otherwise.

    Bollard thrust is ``ahead n|n|`` and ``astern n|n|`` [N over rpm²], to `most_rpm` either way.
    """

    name: str
    x: float
    y: float
    z: float
    ahead: float
    astern: float
    most_rpm: float
    angle_deg: float | None = None


@dataclass(frozen=True)
class House:
    """A box above the water: centre `x` [m], `length`, `width` and `height` [m]."""

    x: float
    length: float
    width: float
    height: float


@dataclass(frozen=True, eq=False)
class Vessel:
    """A vessel of the plant.

    Attributes
    ----------
    length, beam, draught, mass
        Main dimensions [m], displacement [kg].
    x_g, z_g
        Centre of gravity, forward and down [m].
    k_xx, k_yy, k_zz
        Radii of gyration about the centre of gravity [m].
    gm_t, gm_l
        Metacentric heights [m].
    added
        Added masses by index pair, such as ``"22"`` or ``"26"`` [kg, kg·m, kg·m²], diagonal and symmetric couplings.
    linear
        Linear damping of surge, sway, heave, roll, pitch and yaw [N s/m, N·m·s].
    wetted_m2, form, residual
        Wetted surface [m²], form factor and residual coefficient of the resistance.
    cross_drag
        Drag coefficients of the sections at stern, midship and bow.
    lift_x
        Where the lift of the hull acts, as a share of the length forward of midship.
    thrusters, houses
        What pushes it, and what the wind finds.
    omega
        Bandwidth of its autopilot in position [rad/s].
    speed_mps, turn_degps
        Fastest motion that the autopilot asks for.
    leg_m
        How far its set points lie apart.
    """

    name: str
    title: str
    length: float
    beam: float
    draught: float
    mass: float
    x_g: float
    z_g: float
    k_xx: float
    k_yy: float
    k_zz: float
    gm_t: float
    gm_l: float
    added: Mapping[str, float]
    linear: tuple[float, float, float, float, float, float]
    wetted_m2: float
    form: float
    residual: float
    cross_drag: tuple[float, float, float]
    lift_x: float
    thrusters: tuple[Thruster, ...]
    houses: tuple[House, ...]
    omega: float
    speed_mps: float
    turn_degps: float
    leg_m: float

    @property
    def waterplane_m2(self) -> float:
        """Area of the waterplane of a hull of these coefficients [m²]."""
        return 0.85 * self.length * self.beam

    @property
    def height_m(self) -> float:
        """How high the wind's force acts above the water [m]."""
        area = sum(house.length * house.height for house in self.houses)
        return 0.5 * sum(house.length * house.height**2 for house in self.houses) / area


FERRY = Vessel(
    name="ferry",
    title="6 m double-ended passenger ferry, two azimuth thrusters",
    length=6.0,
    beam=2.6,
    draught=0.45,
    mass=3200.0,
    x_g=0.05,
    z_g=-0.2,
    k_xx=0.9,
    k_yy=1.6,
    k_zz=1.65,
    gm_t=1.1,
    gm_l=6.0,
    added={"11": 210.0, "22": 1850.0, "33": 3600.0, "44": 900.0, "55": 5200.0, "66": 4300.0}
    | {"24": -160.0, "15": 60.0, "26": 140.0, "46": -30.0},
    linear=(55.0, 170.0, 4200.0, 2600.0, 9000.0, 420.0),
    wetted_m2=17.0,
    form=0.3,
    residual=0.009,
    cross_drag=(0.8, 0.55, 0.8),
    lift_x=0.2,
    thrusters=(
        Thruster("fore", 2.1, 0.0, 0.6, 4.4e-4, 2.9e-4, 1200.0),
        Thruster("aft", -2.1, 0.0, 0.6, 4.4e-4, 2.9e-4, 1200.0),
    ),
    houses=(House(0.0, 6.0, 2.6, 0.6), House(0.2, 3.6, 2.2, 1.5)),
    omega=0.28,
    speed_mps=0.8,
    turn_degps=5.0,
    leg_m=14.0,
)
WORKBOAT = Vessel(
    name="workboat",
    title="9 m workboat, four azimuth thrusters at its corners",
    length=9.0,
    beam=3.4,
    draught=0.6,
    mass=8800.0,
    x_g=-0.15,
    z_g=-0.3,
    k_xx=1.2,
    k_yy=2.4,
    k_zz=2.5,
    gm_t=1.3,
    gm_l=10.0,
    added={"11": 520.0, "22": 4900.0, "33": 9800.0, "44": 3000.0, "55": 29000.0, "66": 26000.0}
    | {"24": -500.0, "15": 240.0, "26": -900.0, "46": 150.0},
    linear=(110.0, 380.0, 11000.0, 9000.0, 42000.0, 1900.0),
    wetted_m2=32.0,
    form=0.25,
    residual=0.007,
    cross_drag=(0.75, 0.6, 0.95),
    lift_x=0.22,
    thrusters=(
        Thruster("port_fore", 3.2, -1.2, 0.7, 3.6e-4, 2.5e-4, 1400.0),
        Thruster("starboard_fore", 3.2, 1.2, 0.7, 3.6e-4, 2.5e-4, 1400.0),
        Thruster("port_aft", -3.2, -1.2, 0.7, 3.6e-4, 2.5e-4, 1400.0),
        Thruster("starboard_aft", -3.2, 1.2, 0.7, 3.6e-4, 2.5e-4, 1400.0),
    ),
    houses=(House(0.0, 9.0, 3.2, 0.8), House(1.8, 2.8, 2.4, 2.0)),
    omega=0.22,
    speed_mps=0.9,
    turn_degps=4.0,
    leg_m=18.0,
)
SURVEYOR = Vessel(
    name="surveyor",
    title="4 m survey catamaran, two fixed propellers and a bow tunnel thruster",
    length=4.0,
    beam=2.0,
    draught=0.32,
    mass=420.0,
    x_g=-0.1,
    z_g=-0.1,
    k_xx=0.75,
    k_yy=1.05,
    k_zz=1.15,
    gm_t=2.4,
    gm_l=5.0,
    added={"11": 26.0, "22": 330.0, "33": 420.0, "44": 90.0, "55": 330.0, "66": 240.0}
    | {"24": -22.0, "15": 8.0, "26": -18.0, "46": 3.0},
    linear=(14.0, 48.0, 800.0, 260.0, 700.0, 45.0),
    wetted_m2=6.4,
    form=0.2,
    residual=0.006,
    cross_drag=(0.7, 0.6, 0.7),
    lift_x=0.18,
    thrusters=(
        Thruster("port", -1.6, -0.7, 0.35, 7.5e-5, 5.2e-5, 1800.0, 0.0),
        Thruster("starboard", -1.6, 0.7, 0.35, 7.5e-5, 5.2e-5, 1800.0, 0.0),
        Thruster("bow", 1.5, 0.0, 0.25, 3.6e-5, 3.6e-5, 1800.0, 90.0),
    ),
    houses=(House(0.0, 4.0, 2.0, 0.35), House(-0.3, 1.2, 1.0, 1.1)),
    omega=0.3,
    speed_mps=0.7,
    turn_degps=7.0,
    leg_m=10.0,
)
VESSELS: Mapping[str, Vessel] = {one.name: one for one in (FERRY, WORKBOAT, SURVEYOR)}
