"""Bundled profiles on the recordings they are for: units, signs and frames show in the kinematics of the log itself.

Position, heading and speed were measured apart from each other, so each checks the others' units, signs and frames.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.ingest import open_log
from ferryid.ingest.log import Series
from ferryid.types import Floats
from ferryid.vessel import applied_force, convert, load_profile, resolve, select
from ferryid.vessel.frames import to_body, wrap, yaw_of_quaternion
from ferryid.vessel.profile import Profile

Locate = Callable[[str], Path]
RATE_HZ = 10.0


def read(profile: Profile, path: Path) -> dict[str, Floats]:
    """Read a log and put its columns on one grid without any repair; enough for statistics over minutes."""
    reader = open_log(path, profile.table)
    series = reader.read(select(profile, reader.topics, str(path)).wanted).values()
    columns: dict[str, tuple[Floats, Floats]] = {}
    for part in series:
        for name, values in convert(profile, part).items():
            columns[name] = (seconds(part), values)
    start = max(t[0] for t, _ in columns.values())
    end = min(t[-1] for t, _ in columns.values())
    grid = np.arange(start, end, 1 / RATE_HZ)
    return {name: held(grid, t, values, name) for name, (t, values) in columns.items()}


def seconds(part: Series) -> Floats:
    return (part.receive_ns - 1_500_000_000_000_000_000) * 1e-9


def held(grid: Floats, t: Floats, values: Floats, name: str) -> Floats:
    if name == "psi" or name.startswith("alpha"):
        values = np.unwrap(values)
    return np.interp(grid, t, values)


def smooth(values: Floats, rows: int) -> Floats:
    return np.convolve(values, np.ones(rows) / rows, mode="valid")


def slopes(columns: dict[str, Floats], rows: int) -> tuple[Floats, Floats, Floats]:
    """Return surge, sway and yaw rate as the slopes of position and heading."""
    north, east = (np.gradient(columns[name], 1 / RATE_HZ) for name in ("x", "y"))
    surge, sway = to_body(north, east, columns["psi"])
    rate = np.gradient(columns["psi"], 1 / RATE_HZ)
    return smooth(surge, rows), smooth(sway, rows), smooth(rate, rows)


def factor(expected: Floats, measured: Floats) -> float:
    """Slope of the regression through the origin: near 1 for the right unit and sign."""
    return float(expected @ measured / (expected @ expected))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "log", "rows", "tolerance"),
    [
        ("esso-osaka", "esso_osaka/random/random_06-Aug-2020_16_24_25_6.csv", 21, (0.03, 0.03, 0.05)),
        ("esso-osaka", "esso_osaka/random/random_31-Jul-2020_12_48_39.csv", 61, (0.03, 0.05, 0.06)),
        ("kvlcc2-model", "kvlcc2/HSVA_CPMC_KVLCC2_Z_20_10_S.dat", 21, (0.01, 0.02, 0.02)),
        ("kvlcc2-model", "kvlcc2/HSVA_CPMC_KVLCC2_Z_35_05.dat", 21, (0.01, 0.02, 0.02)),
        ("vtec-usv", "vtec_usv/48000_2016-02-11-10-52-07.bag", 15, (0.06, 0.4, 0.02)),
        ("vtec-usv", "vtec_usv/exp39_1_2016-02-11-10-47-10.bag", 15, (0.06, 0.9, 0.02)),
        ("milliampere-2025", "milliampere1", 21, (0.1, 0.1, 0.01)),
    ],
)
def test_speeds_are_the_slopes_of_the_pose(
    name: str, log: str, rows: int, tolerance: tuple[float, float, float], shared_data: Locate
) -> None:
    profile = load_profile(name)
    columns = read(profile, shared_data(log))
    out = resolve(profile, columns, RATE_HZ)
    for axis, slope, allowed in zip(("u", "v", "r"), slopes(columns, rows), tolerance, strict=True):
        values = np.nan_to_num(out[axis])
        assert factor(slope, smooth(values, rows)) == pytest.approx(1.0, abs=allowed), axis


def test_gunnerus_apart_from_its_jumps(shared_data: Locate) -> None:
    """Medians over 5 s leave out the jumps of the position and the headings interpolated across north."""
    profile = load_profile("gunnerus")
    columns = read(profile, shared_data("gunnerus/RVG_ManeuveringTests.csv"))
    out = resolve(profile, columns, RATE_HZ)
    block = 50
    rows = len(out["u"]) // block * block
    surge, sway, rate = (np.median(part[:rows].reshape(-1, block), axis=1) for part in slopes(columns, 1))
    for axis, slope in (("u", surge), ("v", sway), ("r", rate)):
        measured = np.median(out[axis][:rows].reshape(-1, block), axis=1)
        sane = (np.abs(rate) < 0.1) & (np.abs(surge) < 8.0) & (np.abs(sway) < 2.0)
        assert factor(slope[sane], measured[sane]) == pytest.approx(1.0, abs=0.1), axis
    azimuth = np.roll(columns["alpha_cmd_azimuth"], int(4 * RATE_HZ))
    assert np.corrcoef(azimuth, out["r"])[0, 1] < -0.85


def test_esso_osaka_wind_is_the_one_it_recorded_itself(shared_data: Locate) -> None:
    """True wind from the apparent columns, against the recording's own columns of true wind."""
    path = shared_data("esso_osaka/random/random_03-Aug-2020_11_04_37.csv")
    profile = load_profile("esso-osaka")
    out = resolve(profile, read(profile, path), RATE_HZ)
    reader = open_log(path, profile.table)
    names = ("wind_velo_true [m/s]", "wind_dir_true [rad]")
    true = reader.read({"table": names})["table"].columns
    north = -true[names[0]] * np.cos(true[names[1]])
    rows = min(len(north), len(out["wind_N"]))
    assert np.sqrt(np.mean((north[:rows] - out["wind_N"][:rows]) ** 2)) < 0.01


@pytest.mark.parametrize(
    ("name", "log", "axis", "low", "high"),
    [
        # Total inertia over the rigid body's: added mass puts it above 1, an order of magnitude would be a wrong unit.
        ("kvlcc2-model", "kvlcc2/HSVA_CPMC_KVLCC2_Z_20_10_S.dat", 2, 0.8, 2.0),
        ("esso-osaka", "esso_osaka/zigzag/zigzag_31-Jul-2020_13_42_53.csv", 2, 0.4, 2.0),
        ("gunnerus", "gunnerus/RVG_ManeuveringTests.csv", 2, 0.7, 2.0),
        ("vtec-usv", "vtec_usv/48000_2016-02-11-10-52-07.bag", 2, 0.5, 2.0),
    ],
)
def test_forces_have_the_size_and_sign_to_turn_the_hull(
    name: str, log: str, axis: int, low: float, high: float, shared_data: Locate
) -> None:
    profile = load_profile(name)
    out = resolve(profile, read(profile, shared_data(log)), RATE_HZ)
    nu = np.stack([out["u"], out["v"], out["r"]], axis=1)
    tau = applied_force(profile, out, nu)[0]
    rows = 21
    u, v, r = (smooth(column, rows) for column in nu.T)
    moment = smooth(tau[:, axis], rows)
    basis = np.stack([np.gradient(r, 1 / RATE_HZ), r, np.abs(r) * r, u * r, v * r, u * v], axis=1)
    inertia = np.linalg.lstsq(basis, moment, rcond=None)[0][0]
    assert low < inertia / profile.hull.inertia_z < high


def test_a_bag_without_navigation_is_refused_in_one_line(shared_data: Locate) -> None:
    path = shared_data("vtec_usv/edge/u_1_psi_ref_2021-08-16-15-07-44.bag")
    profile = load_profile("vtec-usv")
    with pytest.raises(FerryIdError, match="position is needed by the profile vtec-usv") as caught:
        select(profile, open_log(path).topics, str(path))
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_milliampere_heading_is_clockwise_from_north_beside_an_enu_velocity(shared_data: Locate) -> None:
    """The receiver's quaternion against the ferry's own navigation, which says that it is NED."""
    profile = load_profile("milliampere-2025")
    reader = open_log(shared_data("milliampere1"), profile.table)
    wanted = select(profile, reader.topics, "milliampere1").wanted
    pose = [f"pose_orientation_{part}" for part in "xyzw"]
    series = reader.read({**wanted, "/navigation/pose": pose})
    receiver, own = series["/vectorVS330/heading"], series["/navigation/pose"]
    assert receiver.stamp_ns is not None
    assert own.stamp_ns is not None
    psi = np.unwrap(convert(profile, receiver)["psi"])
    start = receiver.stamp_ns[0]
    at = np.interp((own.stamp_ns - start) * 1e-9, (receiver.stamp_ns - start) * 1e-9, psi)
    expected = yaw_of_quaternion(*(own.columns[name] for name in pose))
    assert np.median(np.abs(wrap(at - expected))) < np.radians(3.0)
