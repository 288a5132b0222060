"""The hull and the wind areas of a profile."""

from __future__ import annotations

import math

import numpy as np

from ferryid.vessel.dimensions import WATER_DENSITY
from ferryid.vessel.faults import LARGEST, TableReader
from ferryid.vessel.profile import Hull, WindAreas

MOST_LENGTH_M, MOST_AREA_M2, MOST_MASS_KG = 1e3, 1e5, 1e9
"""Beyond the largest ships; `MOST_RATIO` is for coefficients without a unit."""
MOST_RATIO = 1e3
UNKNOWN = "unknown"
MOST_SPREAD = 1.0
"""A coefficient that may be off by more than itself is not known."""

DAMPING_TERMS = (
    "X_u",
    "X_|u|u",
    "X_uuu",
    "Y_v",
    "Y_|v|v",
    "Y_|r|v",
    "Y_vvv",
    "Y_r",
    "Y_|v|r",
    "Y_|r|r",
    "N_v",
    "N_|v|v",
    "N_|r|v",
    "N_r",
    "N_|v|r",
    "N_|r|r",
    "N_rrr",
    "Y_uv",
    "Y_ur",
    "N_uv",
    "N_ur",
)
"""SNAME damping coefficients of the hull model, thesis (2.14) in its corrected form, and those of lift."""

_DIAGONAL = (
    *("X_u", "X_|u|u", "X_uuu"),
    *("Y_v", "Y_|v|v", "Y_|r|v", "Y_vvv"),
    *("N_r", "N_|v|r", "N_|r|r", "N_rrr"),
)


def parse_hull(reader: TableReader | None) -> Hull | None:
    """Read ``[hull]`` with its mass matrix and damping; None, with faults noted, where it cannot be used."""
    if reader is None:
        return None
    length_m = reader.number("length_m", above=0.0, within=MOST_LENGTH_M)
    beam_m = reader.number("beam_m", above=0.0, within=MOST_LENGTH_M)
    draught_m = reader.number("draught_m", above=0.0, within=MOST_LENGTH_M)
    mass_kg = reader.number("mass_kg", required=True, above=0.0, within=MOST_MASS_KG)
    x_g_m = reader.number("x_g_m", 0.0, within=MOST_LENGTH_M)
    inertia_z = _inertia(reader, mass_kg, x_g_m)
    rigid = rigid_mass(mass_kg, x_g_m, inertia_z)
    total = _mass_matrix(reader.table("M"), rigid)
    damping = _damping(reader.table("D"))
    spread = _spread(reader)
    if not math.isnan(spread) and not damping:
        reader.fault(
            '"spread" is how far off [hull.M] and [hull.D] may be, and there is no [hull.D]. Fix: remove it', "spread"
        )
    reader.close()
    if not math.isnan(length_m) and abs(x_g_m) > length_m:
        reader.fault(f'"x_g_m" = {x_g_m:g} lies outside a hull of {length_m:g} m', "x_g_m")
    _check_size(reader, length_m, beam_m, draught_m, mass_kg)
    _check_gyration(reader, length_m, beam_m, inertia_z / mass_kg - x_g_m**2)
    return Hull(length_m, beam_m, draught_m, mass_kg, inertia_z, x_g_m, total, damping, spread)


def _check_size(reader: TableReader, length_m: float, beam_m: float, draught_m: float, mass_kg: float) -> None:
    """Note a hull that is broader or deeper than long, and a mass that it cannot carry; comparisons with NaN are false."""
    for key, size in (("beam_m", beam_m), ("draught_m", draught_m)):
        if size > length_m:
            reader.fault(
                f'"{key}" = {size:g} is more than the length of {length_m:g} m. Fix: check both and their units',
                key,
                warning=True,
            )
    remedy = "Fix: give mass_kg in kg (1 t is 1000 kg), or correct the dimensions"
    cube_kg = WATER_DENSITY * length_m**3
    # Where the draught is not given, no hull draws more than it is wide.
    depth_m = beam_m if math.isnan(draught_m) else draught_m
    box_kg = WATER_DENSITY * length_m * beam_m * depth_m
    if mass_kg > cube_kg:
        reader.fault(
            f'"mass_kg" = {mass_kg:g} cannot float: a cube of water as long as the hull, {length_m:g} m, has '
            f"{cube_kg:.3g} kg. {remedy}",
            "mass_kg",
        )
    elif mass_kg > box_kg:
        reader.fault(
            f'"mass_kg" = {mass_kg:g} is more than the water in a box around the hull, {length_m:g} m long, '
            f"{beam_m:g} m wide and {depth_m:g} m deep: {box_kg:.3g} kg. {remedy}",
            "mass_kg",
            warning=True,
        )


def _check_gyration(reader: TableReader, length_m: float, beam_m: float, square_m2: float) -> None:
    """Note a radius of gyration, whose square is given, that no distribution of the mass over the hull has."""
    if not square_m2 > 0.0:
        return
    radius_m = math.sqrt(square_m2)
    key = "k_zz_m" if reader.has("k_zz_m") else "inertia_z"
    corner_m = 0.5 * math.hypot(length_m, length_m if math.isnan(beam_m) else beam_m)
    shown = (
        f'"{key}" = {radius_m:g}'
        if key == "k_zz_m"
        else f'"{key}" means a radius of gyration of {radius_m:.3g} m, which'
    )
    remedy = "Fix: check it and its unit; it is typically a quarter of the length"
    if radius_m > length_m:
        reader.fault(f"{shown} is more than the length of {length_m:g} m, which cannot be. {remedy}", key)
    elif radius_m > corner_m:
        reader.fault(
            f"{shown} is farther from the middle than any corner of the hull, {corner_m:.3g} m. {remedy}",
            key,
            warning=True,
        )


def _spread(reader: TableReader) -> float:
    """Take how far off the coefficients are believed to be: a share of each, or that it is not known."""
    if not isinstance(reader.data.get("spread"), str):
        return reader.number("spread", above=0.0, at_most=MOST_SPREAD)
    given = reader.text("spread")
    if given != UNKNOWN:
        reader.fault(f'"spread" cannot be "{given}". Fix: give a share, such as 0.3 for 30 %, or "{UNKNOWN}"', "spread")
    return math.inf


def rigid_mass(mass_kg: float, x_g_m: float, inertia_z: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return the rigid-body mass matrix about the body origin, shape (3, 3); Fossen (2021), section 3.3."""
    return np.array(
        [
            [mass_kg, 0.0, 0.0],
            [0.0, mass_kg, mass_kg * x_g_m],
            [0.0, mass_kg * x_g_m, inertia_z],
        ]
    )


def parse_wind(reader: TableReader | None) -> WindAreas | None:
    """Read ``[wind]``."""
    if reader is None:
        return None
    areas = WindAreas(
        frontal_m2=reader.number("frontal_m2", required=True, above=0.0, within=MOST_AREA_M2),
        lateral_m2=reader.number("lateral_m2", required=True, above=0.0, within=MOST_AREA_M2),
        length_m=reader.number("length_m", required=True, above=0.0, within=MOST_LENGTH_M),
        S_L_m=reader.number("S_L_m", 0.0, within=MOST_LENGTH_M),
        CD_t=reader.number("CD_t", required=True, above=0.0, within=MOST_RATIO),
        CD_l_AF=reader.number("CD_l_AF", required=True, above=0.0, within=MOST_RATIO),
        delta=reader.number("delta", required=True, at_least=0.0, at_most=1.0),
    )
    reader.close()
    return areas


def _inertia(reader: TableReader, mass_kg: float, x_g_m: float) -> float:
    """Take the moment of inertia about the body origin, given as such or as a radius of gyration about CG."""
    given = reader.has("inertia_z")
    radius_given = reader.has("k_zz_m")
    inertia_z = reader.number("inertia_z", above=0.0)
    k_zz_m = reader.number("k_zz_m", above=0.0, within=MOST_LENGTH_M)
    if given and radius_given:
        reader.fault('"inertia_z" and "k_zz_m" say the same thing. Fix: keep one of them', "k_zz_m")
    if not given and not radius_given:
        reader.fault(
            "[hull] lacks a moment of inertia in yaw. Fix: add inertia_z (kg*m², about the body origin) or "
            "k_zz_m (m, radius of gyration about the centre of gravity, typically a quarter of the length)"
        )
    if radius_given:
        return mass_kg * (k_zz_m**2 + x_g_m**2)
    if inertia_z <= mass_kg * x_g_m**2:
        reader.fault(
            f'"inertia_z" = {inertia_z:g} is about the body origin and must exceed mass_kg·x_g_m² = '
            f"{mass_kg * x_g_m**2:g}",
            "inertia_z",
        )
    return inertia_z


def _mass_matrix(
    reader: TableReader | None, rigid: np.ndarray[tuple[int, int], np.dtype[np.float64]]
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    if reader is None:
        return rigid
    m11, m22, m33 = (
        reader.number(key, required=True, above=0.0, within=most)
        for key, most in (("m11", 1e11), ("m22", 1e11), ("m33", LARGEST))
    )
    m23, m32 = (reader.number(key, 0.0) for key in ("m23", "m32"))
    reader.close()
    total = np.array([[m11, 0.0, 0.0], [0.0, m22, m23], [0.0, m32, m33]])
    if not np.all(np.isfinite(total)):
        return rigid
    smallest = float(np.linalg.eigvalsh(0.5 * (total + total.T))[0])
    if smallest <= 0.0:
        reader.fault(
            f"the mass matrix is not positive definite (its symmetric part has the eigenvalue {smallest:g}), so a "
            "force would accelerate the vessel backwards. Fix: check m22·m33 > ((m23 + m32)/2)²"
        )
    for index, key in enumerate(("m11", "m22", "m33")):
        if np.isfinite(rigid[index, index]) and total[index, index] < rigid[index, index]:
            reader.fault(
                f'"{key}" = {total[index, index]:g} is less than the rigid body\'s {rigid[index, index]:g}: the added '
                "mass would be negative. Fix: M is the total, rigid body plus added mass",
                key,
                warning=True,
            )
    return total


def _damping(reader: TableReader | None) -> dict[str, float]:
    if reader is None:
        return {}
    terms = {term: reader.number(term) for term in DAMPING_TERMS if reader.has(term)}
    reader.close()
    terms = {term: value for term, value in terms.items() if not math.isnan(value)}
    for term in _DIAGONAL:
        if terms.get(term, 0.0) > 0.0:
            reader.fault(
                f'"{term}" = {terms[term]:g} is positive and feeds energy into the motion: SNAME coefficients of '
                "damping are negative. Fix: change its sign unless that is meant",
                term,
                warning=True,
            )
    sway, yaw = -terms.get("Y_v", 0.0), -terms.get("N_r", 0.0)
    cross = -0.5 * (terms.get("Y_r", 0.0) + terms.get("N_v", 0.0))
    if sway >= 0.0 and yaw >= 0.0 and sway * yaw < cross**2:
        reader.fault(
            "the linear damping of sway and yaw is not dissipative: ((Y_r + N_v)/2)² exceeds Y_v·N_r, so some "
            "slow motion gains energy. Fix: check the signs and units of Y_r and N_v",
            warning=True,
        )
    return terms
