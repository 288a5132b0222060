"""First-order force of waves on the hull, their mean drift, and the wakes of passing boats.

The Froude-Krylov force: the pressure of the undisturbed waves on the wetted surface of a box of the hull's length, beam and
draught around the body origin. By Gauss's theorem it is the integral of the pressure's gradient over the box, which
has a closed form. Phases are taken where the vessel is, so the encounter frequency follows. Deep water; the current does
not change the waves.

The diffraction force comes on top of it in the approximation for long waves (Faltinsen 1990, Sea Loads, ch. 3): the added mass
times the acceleration of the water. Each amplitude of the Froude-Krylov force, which is that acceleration times the
displaced mass, is multiplied by ``1 + A / (rho V)``, so that in long waves the hull moves as the water does. This
neglects the diffraction of waves as short as the hull, which is weaker and out of phase; the coupling of sway and yaw by added
mass; and the orbital velocity in the damping, which acts on the velocity against the current alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, exp, isnan, pi, sin
from typing import NamedTuple

import numpy as np

from ferryid.compiled import borrowing, compiled
from ferryid.errors import FerryIdError
from ferryid.simulate.noise import generator
from ferryid.simulate.plant.hull import Force
from ferryid.simulate.plant.spectrum import components, deep_water
from ferryid.simulate.sections import Wake, Waves
from ferryid.types import Floats
from ferryid.vessel.profile import Profile
from ferryid.vessel.thrusters import FRESH_WATER

GRAVITY = 9.81
"""[m/s²]"""
HEADINGS = 1440
"""Headings at which the force of every component is tabulated; linear in between."""
ENVELOPE = 8.0
"""Standard deviations from its middle at which a wake is over."""


class Sea(NamedTuple):
    """K components, first those of the sea, then one for each of W wakes; phases in turns.

    `frequency` [1/s], `north`, `east` (wave number [1/m] along either) and `phase` have shape (K,). `table`
    (HEADINGS + 1, 3, K) holds the amplitudes of surge and sway force, which go with the sine of the phase, and of the yaw
    moment, with the cosine.
    `wakes` (W, 2) holds middle and standard deviation [s] of each envelope. `drift` is the mean force per metre of width
    shown [N/m], `go` its direction (north, east). `box` is length, beam and draught [m], `diffraction` what the Froude-Krylov
    force in surge, sway and yaw has been multiplied by. `terms` (3, K) is written anew.
    """

    sea: int
    frequency: Floats
    north: Floats
    east: Floats
    phase: Floats
    table: Floats
    wakes: Floats
    drift: float
    go: tuple[float, float]
    box: tuple[float, float, float]
    diffraction: tuple[float, float, float]
    terms: Floats


def sea_of(
    profile: Profile,
    waves: Waves,
    wakes: Sequence[Wake],
    seed: int,
    added: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Sea:
    """Return the sea and the wakes that a vessel meets.

    Parameters
    ----------
    profile
        The vessel.
    waves, wakes, seed
        What it meets.
    added
        Added mass A_11, A_22 [kg] and A_66 [kg·m²]; zero leaves the Froude-Krylov force alone.

    Raises
    ------
    FerryIdError
        When there are waves and the hull's size is not known.
    """
    passing = [wake for wake in wakes if wake.height_m > 0.0]
    n = waves.components if waves.significant_height_m > 0.0 else 0
    count = n + len(passing)
    box = _box(profile) if count else (1.0, 1.0, 1.0)
    random = generator(seed, "waves")
    places, phases = random.random(waves.components), random.random(waves.components)
    frequency, amplitude = np.zeros(count), np.zeros(count)
    direction, phase = np.zeros(count), np.zeros(count)
    if n:
        frequency[:n], amplitude[:n] = components(waves.significant_height_m, waves.peak_period_s, waves.gamma, places)
        direction[:n] = waves.direction_deg * pi / 180.0
        phase[:n] = phases
    for i, wake in enumerate(passing, n):
        frequency[i], amplitude[i] = 1.0 / wake.period_s, 0.5 * wake.height_m
        direction[i] = wake.direction_deg * pi / 180.0
        # A crest passes the start of the trial in the middle of the group.
        phase[i] = -frequency[i] * wake.at_s
    number = np.array([deep_water(float(f), GRAVITY) for f in frequency])
    c, s = (np.array([turn(float(angle)) for angle in direction]) for turn in (cos, sin))
    table = amplitudes(number, amplitude, direction, box)
    L, B, T = box
    displaced = FRESH_WATER * L * B * T
    inertia = displaced * (L * L + B * B) / 12.0
    diffraction = (1.0 + added[0] / displaced, 1.0 + added[1] / displaced, 1.0 + added[2] / inertia)
    for axis in range(3):
        table[:, axis] *= diffraction[axis]
    height, toward = waves.significant_height_m, waves.direction_deg * pi / 180.0
    return Sea(
        sea=n,
        frequency=frequency,
        north=number * c / (2.0 * pi),
        east=number * s / (2.0 * pi),
        phase=phase,
        table=table,
        wakes=np.array([(wake.at_s, 0.25 * wake.duration_s) for wake in passing]).reshape(-1, 2),
        drift=waves.drift_coefficient * FRESH_WATER * GRAVITY * height * height / 16.0,
        go=(cos(toward), sin(toward)),
        box=box,
        diffraction=diffraction,
        terms=np.zeros((3, count)),
    )


def _box(profile: Profile) -> tuple[float, float, float]:
    hull = profile.hull
    if isnan(hull.length_m) or isnan(hull.beam_m):
        raise FerryIdError(
            f"{profile.name}: waves need the size of the hull, found no length_m or beam_m in the profile. "
            "Fix: add both to [hull]"
        )
    area = hull.length_m * hull.beam_m
    draught_m = hull.mass_kg / (FRESH_WATER * area) if isnan(hull.draught_m) else hull.draught_m
    return float(hull.length_m), float(hull.beam_m), float(draught_m)


@borrowing
def sinc(p: float) -> float:
    """Return ``sin p / p``."""
    if abs(p) < 0.1:
        q = p * p
        return 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0)))
    return sin(p) / p


@borrowing
def lever(p: float) -> float:
    """Return ``(sin p - p cos p) / p²``, the spherical Bessel function of first order."""
    if abs(p) < 0.3:
        q = p * p
        return p / 3.0 * (1.0 - q / 10.0 * (1.0 - q / 28.0 * (1.0 - q / 54.0 * (1.0 - q / 88.0 * (1.0 - q / 130.0)))))
    return (sin(p) - p * cos(p)) / (p * p)


@compiled
def amplitudes(number: Floats, amplitude: Floats, direction: Floats, box: tuple[float, float, float]) -> Floats:
    """Return the amplitudes of each component's Froude-Krylov force, shape (HEADINGS + 1, 3, K) [N, N, N·m].

    Parameters
    ----------
    number, amplitude, direction
        Wave number [rad/m], amplitude [m] and direction it goes to [rad] of each component, shape (K,).
    box
        Length, beam and draught [m].
    """
    L, B, T = box
    count = len(number)
    table = np.empty((HEADINGS + 1, 3, count))
    for j in range(count):
        k = number[j]
        # The gradient k e^{kz} integrated over the draught.
        scale = FRESH_WATER * GRAVITY * amplitude[j] * (1.0 - exp(-k * T))
        for i in range(HEADINGS + 1):
            angle = direction[j] - i * (2.0 * pi / HEADINGS)
            c, s = cos(angle), sin(angle)
            p, q = 0.5 * k * L * c, 0.5 * k * B * s
            along, across = L * sinc(p), B * sinc(q)
            table[i, 0, j] = -scale * c * along * across
            table[i, 1, j] = -scale * s * along * across
            table[i, 2, j] = scale * (0.5 * L * L * lever(p) * s * across - 0.5 * B * B * lever(q) * c * along)
    return table


@borrowing
def sine_cosine(turns: float) -> tuple[float, float]:
    """Return sine and cosine of an angle in turns, to a few units of the last place of 1.

    Taylor series of half the angle, at most a quarter turn: of forty components, the library's functions took four fifths of a
    trial's time. Factors are those between neighbouring terms.
    """
    p = pi * (turns - np.rint(turns))
    q = p * p
    s = 1.0 - q * (1.0 / 272.0) * (1.0 - q * (1.0 / 342.0) * (1.0 - q * (1.0 / 420.0)))
    s = 1.0 - q * (1.0 / 110.0) * (1.0 - q * (1.0 / 156.0) * (1.0 - q * (1.0 / 210.0) * s))
    s = 1.0 - q * (1.0 / 20.0) * (1.0 - q * (1.0 / 42.0) * (1.0 - q * (1.0 / 72.0) * s))
    s = p * (1.0 - q * (1.0 / 6.0) * s)
    c = 1.0 - q * (1.0 / 306.0) * (1.0 - q * (1.0 / 380.0) * (1.0 - q * (1.0 / 462.0)))
    c = 1.0 - q * (1.0 / 132.0) * (1.0 - q * (1.0 / 182.0) * (1.0 - q * (1.0 / 240.0) * c))
    c = 1.0 - q * (1.0 / 30.0) * (1.0 - q * (1.0 / 56.0) * (1.0 - q * (1.0 / 90.0) * c))
    c = 1.0 - q * 0.5 * (1.0 - q * (1.0 / 12.0) * c)
    return 2.0 * s * c, 1.0 - 2.0 * s * s


@borrowing
def first_order(sea: Sea, t: float, x: float, y: float, psi: float) -> Force:
    """Return the first-order force [N, N, N·m] at a time [s] on a vessel at a place [m] and heading [rad]."""
    count = len(sea.frequency)
    if count == 0:
        return 0.0, 0.0, 0.0
    place = psi * (HEADINGS / (2.0 * pi))
    node = np.floor(place)
    share = place - node
    node = int(node) % HEADINGS
    low, high = sea.table[node], sea.table[node + 1]
    frequency, north, east, phase, terms = sea.frequency, sea.north, sea.east, sea.phase, sea.terms
    # A loop of its own, without branches or calls, so that several components are computed at once.
    for j in range(count):
        terms[0, j], terms[1, j] = sine_cosine(frequency[j] * t - north[j] * x - east[j] * y + phase[j])
    for j in range(count):
        sine, cosine = terms[0, j], terms[1, j]
        terms[0, j] = (low[0, j] + share * (high[0, j] - low[0, j])) * sine
        terms[1, j] = (low[1, j] + share * (high[1, j] - low[1, j])) * sine
        terms[2, j] = (low[2, j] + share * (high[2, j] - low[2, j])) * cosine
    X, Y, N = 0.0, 0.0, 0.0
    for j in range(sea.sea):
        X += terms[0, j]
        Y += terms[1, j]
        N += terms[2, j]
    for w in range(len(sea.wakes)):
        apart = (t - sea.wakes[w, 0]) / sea.wakes[w, 1]
        if abs(apart) < ENVELOPE:
            height = exp(-0.5 * apart * apart)
            j = sea.sea + w
            X += height * terms[0, j]
            Y += height * terms[1, j]
            N += height * terms[2, j]
    return X, Y, N


@borrowing
def wave_load(sea: Sea, t: float, x: float, y: float, psi: float, cos_psi: float, sin_psi: float) -> Force:
    """Return the force of waves and wakes with the sea's mean drift [N, N, N·m]; parameters as of `first_order`."""
    X, Y, N = first_order(sea, t, x, y, psi)
    if sea.drift > 0.0:
        c = sea.go[0] * cos_psi + sea.go[1] * sin_psi
        s = sea.go[1] * cos_psi - sea.go[0] * sin_psi
        push = sea.drift * (sea.box[0] * abs(s) + sea.box[1] * abs(c))
        X += push * c
        Y += push * s
    return X, Y, N


@borrowing
def slopes(sea: Sea, t: float, x: float, y: float, psi: float) -> tuple[float, float]:
    """Return the slope of the water under the hull, forward and to starboard [rad], as the box feels it.

    What pushes a floating body sideways is the slope that it stands on: the Froude-Krylov force over the displaced weight.
    """
    X, Y, _ = first_order(sea, t, x, y, psi)
    weight = FRESH_WATER * GRAVITY * sea.box[0] * sea.box[1] * sea.box[2]
    return -X / (weight * sea.diffraction[0]), -Y / (weight * sea.diffraction[1])
