"""Concealed effects: records change as worked out by hand, and the library's own effect explains them."""

from __future__ import annotations

from dataclasses import replace
from math import cos, radians, sin, tanh
from pathlib import Path

import numpy as np
import pytest

from ferryid.diagnose.checks import held_samples
from ferryid.effects import effects
from ferryid.effects.force_model import Measurements, hull_of, required_force
from ferryid.effects.measurements import hull_force_model
from ferryid.ingest import open_log
from ferryid.ingest.log import Series
from ferryid.simulate.recorders import write_json_mcap
from ferryid.simulate.sensors import quaternion
from ferryid.types import Floats
from ferryid.validation.case import Truth
from ferryid.validation.plant.effects.payload import BOARDING_S
from ferryid.validation.recorded.allocation import conceal_load
from ferryid.validation.recorded.drives import drives
from ferryid.validation.recorded.effects import SENSOR, Concealment, concealments
from ferryid.validation.recorded.effects.thruster_interaction import left_by
from ferryid.validation.recorded.effects.waves import series
from ferryid.validation.recorded.given_back import left_over
from ferryid.validation.recorded.hull import current_load, damping, wind_load
from ferryid.validation.recorded.log import RecordedLog
from ferryid.validation.recorded.signal_values import with_columns
from ferryid.vessel.signal_map import convert
from tests.validation.recorded_logs import KINDS, ferry, folder, tanker, written

pytestmark = pytest.mark.slow

EDGE = 20
"""Rows at either end, where a slope is one-sided."""


def altered(
    log: RecordedLog, effect: str, values: dict[str, float], instance: str | None = None, **span: float
) -> RecordedLog:
    made = concealments()[effect].conceal(log, Truth(effect, instance, values, **span), np.random.default_rng(1))
    assert made.missed < 0.02
    return made.log


def reread(log: RecordedLog, place: Path) -> Measurements:
    """Return what a changed recording measures once it was written."""
    return written(log, place).measurements


def same(before: Measurements, after: Measurements, *names: str) -> bool:
    return all(np.allclose(getattr(before, name), getattr(after, name), atol=1e-9, equal_nan=True) for name in names)


@pytest.mark.parametrize("size", [0.1, 0.6, 4.0])
def test_an_antenna_is_aboard(size: float) -> None:
    one, half = concealments()["lever_arm"], 0.5 * ferry().profile.hull.beam_m
    for seed in range(20):
        arm = one.sample(size, ferry(), np.random.default_rng(seed), (None, None)).values
        assert np.hypot(arm["x"], arm["y"]) == pytest.approx(size)
        assert abs(arm["y"]) < half


@pytest.mark.parametrize("kind", KINDS)
def test_an_unaltered_recording_reads_as_it_was(kind: str, tmp_path: Path) -> None:
    log = KINDS[kind]()
    assert log.kind == kind
    again = reread(log, tmp_path)
    for name in ("t", "eta", "nu_raw", "nu", "parts", "angles", "usable"):
        assert np.array_equal(getattr(log.measurements, name), getattr(again, name), equal_nan=True), name


@pytest.mark.parametrize("kind", KINDS)
def test_an_antenna_off_the_origin(kind: str, tmp_path: Path) -> None:
    log = KINDS[kind]()
    before = log.measurements
    after = reread(altered(log, "lever_arm", {"x": 2.0, "y": -1.0}), tmp_path)
    moved, psi = after.eta - before.eta, before.psi
    assert np.allclose(moved[:, 0], 2.0 * np.cos(psi) + np.sin(psi), atol=1e-3)
    assert np.allclose(moved[:, 1], 2.0 * np.sin(psi) - np.cos(psi), atol=1e-3)
    assert same(before, after, "nu_raw", "parts")


@pytest.mark.parametrize("kind", KINDS)
def test_a_heading_that_is_off(kind: str, tmp_path: Path) -> None:
    log = KINDS[kind]()
    before = log.measurements
    after = reread(altered(log, "heading_bias", {"angle": 5.0}), tmp_path)
    turned = np.mod(after.psi - before.psi + 3.0, 2.0 * np.pi) - 3.0
    assert np.allclose(np.degrees(turned), 5.0)
    u, v = before.nu_raw[:, 0], before.nu_raw[:, 1]
    # The tank's velocities are along its walls: those along the hull follow from the heading.
    b = radians(5.0) if kind == "table" else 0.0
    assert np.allclose(after.nu_raw[:, 0], cos(b) * u + sin(b) * v)
    assert np.allclose(after.nu_raw[:, 1], cos(b) * v - sin(b) * u)


def test_a_heading_turns_and_the_tilt_stays() -> None:
    log = ferry()
    series = log.series[log.topics["psi"]]
    n = len(series.receive_ns)
    names = [f"pose.pose.orientation.{axis}" for axis in "xyzw"]
    tilted = quaternion(np.full(n, 0.1), np.full(n, -0.2), np.full(n, 1.0))
    series = replace(series, columns=series.columns | dict(zip(names, tilted, strict=True)))
    made = with_columns(log.profile, series, {"psi": np.full(n, 1.5)})
    wanted = quaternion(np.full(n, 0.1), np.full(n, -0.2), np.full(n, 1.5))
    for name, values in zip(names, wanted, strict=True):
        assert np.allclose(made.columns[name], values), name


def test_a_signal_that_is_scaled_is_written_as_its_instrument_reads() -> None:
    log = ferry()
    own = log.series[log.topics["u"]]
    n = len(own.receive_ns)
    signals = tuple(
        replace(one, scale=0.8) if one.quantity in ("velocity", "yaw_rate") else one for one in log.profile.signals
    )
    new = {"u": np.linspace(-1.0, 1.0, n), "v": np.full(n, 0.2), "r": np.full(n, 0.05)}
    profile = replace(log.profile, signals=signals)
    read = convert(profile, with_columns(profile, own, new))
    for name, values in new.items():
        assert np.allclose(read[name], values), name


def test_paths_of_messages_lead_where_they_led(tmp_path: Path) -> None:
    receive = np.array([5, 3, 9], dtype=np.int64) + 1_700_000_000_000_000_000
    columns = {
        "a.b": np.array([1.5, np.nan, -2.0]),
        "c[2].d": np.array([1, 2, 3]),
        "c[0].d": np.arange(3.0),
        "e[1]": np.arange(3.0),
    }
    path = tmp_path / "paths.mcap"
    write_json_mcap([Series("/some/topic", receive, receive - 7, columns)], path)
    read = open_log(path).read({"/some/topic": list(columns)})["/some/topic"]
    order = [1, 0, 2]
    assert read.receive_ns.tolist() == receive[order].tolist()
    assert read.stamp_ns is not None
    assert read.stamp_ns.tolist() == (receive[order] - 7).tolist()
    for name, values in columns.items():
        assert np.array_equal(read.columns[name].astype(float), values[order].astype(float), equal_nan=True), name


def test_times_are_written_to_the_nanosecond() -> None:
    for topic, one in folder().series.items():
        assert np.array_equal(one.receive_ns, ferry().series[topic].receive_ns), topic


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("effect", "axes"), [("velocity_scale", (0, 1)), ("yaw_rate_scale", (2,))])
def test_a_scale(kind: str, effect: str, axes: tuple[int, ...], tmp_path: Path) -> None:
    log = KINDS[kind]()
    before, after = log.measurements, reread(altered(log, effect, {"factor": 1.25}), tmp_path)
    for axis in range(3):
        assert np.allclose(after.nu_raw[:, axis], (1.25 if axis in axes else 1.0) * before.nu_raw[:, axis])
    assert same(before, after, "eta")


def test_late_topics_are_stamped_later() -> None:
    log = ferry()
    after = altered(log, "time_delay", {"seconds": 0.3})
    odometry, thruster = log.topics["x"], log.topics[next(iter(drives(log).values())).column]
    assert np.all(after.series[odometry].receive_ns - log.series[odometry].receive_ns == 300_000_000)
    stamp, before = after.series[odometry].stamp_ns, log.series[odometry].stamp_ns
    assert stamp is not None
    assert before is not None
    assert np.all(stamp - before == 300_000_000)
    assert after.series[thruster] is log.series[thruster]


@pytest.mark.parametrize(
    ("effect", "late"), [("time_delay", {"x", "y", "psi", "u", "thrust"}), ("clock_offset", {"x", "y"})]
)
def test_late_columns_of_a_table_stand_further_down(effect: str, late: set[str]) -> None:
    log = tanker()
    assert concealments()[effect].sample(0.33, log, np.random.default_rng(), (None, None)).values == {"seconds": 0.35}
    before, after = log.series["table"].columns, altered(log, effect, {"seconds": 0.35}).series["table"].columns
    # Seven rows of 0.05 s; thrust and rudder are the actuators'.
    for name in ("x", "y", "psi", "u", "thrust", "rudder"):
        moved = name in late - {"thrust"}
        assert np.array_equal(after[name], before[name][:-7] if moved else before[name][7:]), name


def test_held_samples_are_a_share_of_the_log() -> None:
    log = tanker()
    after = altered(log, "held_samples", {"share": 10.0}).series["table"].columns
    before = log.series["table"].columns
    repeated = np.diff(after["x"]) == 0.0
    # A tenth of 60 s, in three stretches of two seconds.
    assert np.count_nonzero(repeated) == pytest.approx(120, abs=3)
    assert np.count_nonzero(np.diff(repeated.astype(int)) == 1) == 3
    assert np.array_equal(repeated, np.diff(after["psi"]) == 0.0)
    assert np.array_equal(after["thrust"], before["thrust"])


def test_held_samples_are_found_though_the_reader_takes_them_out(tmp_path: Path) -> None:
    log = altered(tanker(), "held_samples", {"share": 10.0})
    finding = held_samples.find(written(log, tmp_path).measurements)
    assert finding is not None
    share = finding.parameters["share"]
    assert share.low <= 10.0 <= share.high
    assert finding.parameters["longest"].value == pytest.approx(2.0, abs=0.2)
    assert held_samples.find(tanker().measurements) is None


def test_rounded_angles() -> None:
    log = ferry()
    column = next(iter(drives(log).values())).turn
    angle = np.degrees(altered(log, "azimuth_resolution", {"step": 10.0}).columns[column])
    assert np.allclose(angle / 10.0, np.round(angle / 10.0))
    apart = np.mod(angle - np.degrees(log.columns[column]) + 180.0, 360.0) - 180.0
    assert np.abs(apart).max() <= 5.0 + 1e-9


def explained(
    log: RecordedLog, again: Measurements, effect: str, values: dict[str, float], instance: str | None
) -> float:
    """Return how much of the added force is left once the library's effect acts on the new record, as a share."""
    model = hull_force_model(again, hull_of(log.profile))
    p = np.array([values.get(one.name, one.neutral) for one in effects()[effect].parameters_of(log.profile)])
    acted, claimed = log.measurements.parts.sum(axis=1), again.parts.sum(axis=1)
    acting = effects()[effect].apply(model, p, instance).parts.sum(axis=1)
    inside = slice(EDGE, -EDGE)
    return size((acting - acted)[inside]) / size((claimed - acted)[inside])


def size(force: Floats) -> float:
    return float(np.sqrt(np.mean(force**2)))


@pytest.mark.parametrize(
    ("effect", "values", "of_one", "left"),
    [
        ("thruster_gain", {"factor": 0.8}, True, 1e-3),
        ("azimuth_offset", {"angle": 7.0}, True, 1e-6),
        ("thruster_lag", {"time_constant": 0.5}, False, 0.05),
        ("thrust_inflow_loss", {"per_mps": 0.2}, False, 1e-2),
    ],
)
def test_the_librarys_effect_takes_back_what_an_actuator_claims(
    effect: str, values: dict[str, float], of_one: bool, left: float, tmp_path: Path
) -> None:
    log = ferry()
    name = next(iter(drives(log))) if of_one else None
    again = reread(altered(log, effect, values, name), tmp_path)
    assert same(log.measurements, again, "eta", "nu_raw")
    assert explained(log, again, effect, values, name) < left


def test_a_propeller_behind_which_a_rudder_stands(tmp_path: Path) -> None:
    log = tanker()
    after = altered(log, "thruster_gain", {"factor": 0.8}, "propeller")
    assert np.allclose(after.columns["F_propeller"], log.columns["F_propeller"] / 0.8)
    assert np.array_equal(after.columns["delta_propeller"], log.columns["delta_propeller"])
    # The rudder feels what acts, in the record and in the library alike.
    assert explained(log, reread(after, tmp_path), "thruster_gain", {"factor": 0.8}, "propeller") < 0.01


@pytest.mark.parametrize(("steps", "other"), [(False, (0.0, 0.35)), (True, (0.5, np.inf))])
def test_a_rudder_that_is_ordered_in_steps_cannot_lag(steps: bool, other: tuple[float, float], tmp_path: Path) -> None:
    log, lag = tanker(), {"time_constant": 0.5}
    if steps:
        helm = np.radians(35.0) * np.sign(np.sin(0.7 * log.times("table")))
        log = written(log.changed({"delta_propeller": helm}), tmp_path)
    # No angle makes up for a rudder that was at once where it was ordered to: its force is bounded.
    left = left_over(log, altered(log, "thruster_lag", lag), Truth("thruster_lag", None, lag))
    assert other[0] <= left < other[1]


def test_a_gain_from_a_time_on() -> None:
    log = tanker()
    after = altered(log, "thruster_gain", {"factor": 0.5}, "propeller", onset_s=30.0)
    ratio, t = after.columns["F_propeller"] / log.columns["F_propeller"], log.times("table")
    assert np.allclose(ratio[t < 30.0], 1.0)
    assert np.allclose(ratio[t >= 30.0], 2.0)
    # Rows that stay keep their raw value to the last bit, whatever the way to SI units and back does.
    series, speed, early = log.series["table"], log.columns["n_propeller"], t < 30.0
    made = with_columns(log.profile, series, {"n_propeller": np.where(early, speed, 1.1 * speed)}).columns["n"]
    assert np.array_equal(made[early], series.columns["n"][early])
    assert np.allclose(made[~early], 1.1 * series.columns["n"][~early])


def test_a_race_takes_the_plants_share() -> None:
    log = ferry()
    made = altered(log, "thruster_interaction", {"fraction": 0.4})
    for name, drive in drives(log).items():
        ratio = made.columns[drive.column] / np.where(
            log.columns[drive.column] == 0.0, np.nan, log.columns[drive.column]
        )
        assert np.nanmin(ratio) >= 1.0 - 1e-9, name
    # Straight into the other's face all of the fraction is lost, at full strength.
    fore, aft = drives(log).values()
    one, zero = np.ones(1), np.zeros(1)
    assert left_by(0.4, fore, aft, one, zero, 1.0) == pytest.approx(0.6)
    assert left_by(0.4, fore, aft, -one, zero, 1.0) == pytest.approx(1.0)
    assert left_by(0.4, fore, aft, 0.04 * one, zero, 1.0) == pytest.approx(0.8)
    # Ten degrees beside it: 0.6 + 0.4 * 1000 / (130 / 0.6³ + 1000).
    assert left_by(0.4, fore, aft, one, radians(10.0) * one, 1.0) == pytest.approx(0.8497, abs=1e-4)


@pytest.mark.parametrize(
    ("effect", "values", "left"),
    [
        ("payload", {"mass": 300.0, "x": 0.5}, 0.02),
        # The plant's line stiffens by less than a hundredth within the few metres that the ferry is from its end.
        ("mooring", {"stiffness_north": 10.0, "stiffness_east": 5.0, "north": 3.0, "east": -4.0}, 0.03),
        # Strips and friction lines in the place of polynomials: alike, and no more.
        ("current", {"north": 0.3, "east": -0.2}, 0.5),
        ("fouling", {"surge": 2.0, "sway": 1.5, "yaw": 1.5}, 0.5),
    ],
)
def test_the_librarys_effect_takes_back_what_a_load_adds(
    effect: str, values: dict[str, float], left: float, tmp_path: Path
) -> None:
    log = ferry()
    again = reread(altered(log, effect, values), tmp_path)
    assert same(log.measurements, again, "eta", "nu_raw")
    model = hull_force_model(log.measurements, hull_of(log.profile))
    p = np.array([values.get(one.name, one.neutral) for one in effects()[effect].parameters_of(log.profile)])
    needed = required_force(effects()[effect].apply(model, p, None), log.acceleration) - required_force(
        model, log.acceleration
    )
    claimed = (again.parts - log.measurements.parts).sum(axis=1)
    inside = slice(EDGE, -EDGE)
    assert size((claimed - needed)[inside]) < left * size(needed[inside])


def test_a_load_that_comes_aboard_takes_momentum(tmp_path: Path) -> None:
    log = ferry()
    values = {"mass": 300.0, "x": 0.0}
    before = conceal_load(log, np.zeros_like(log.measurements.nu)).log
    for drive in drives(log).values():
        assert np.allclose(before.columns[drive.column], log.columns[drive.column], atol=1e-6)
    made = altered(log, "payload", values, onset_s=20.0)
    always, later = (reread(one, tmp_path).parts.sum(axis=1) for one in (altered(log, "payload", values), made))
    acted, row = log.measurements.parts.sum(axis=1), int(np.searchsorted(log.measurements.t, 20.0))
    # Half of it is aboard, and its momentum comes at a sixth a second.
    momentum = values["mass"] * log.measurements.nu[row, :2] / BOARDING_S
    assert np.allclose((later - acted)[row, :2], 0.5 * (always - acted)[row, :2] + momentum, atol=2.0)
    assert np.abs(momentum).max() > 10.0
    t = log.times(log.topics[next(iter(drives(log).values())).column])
    column = next(iter(drives(log).values())).column
    # The slope of what is aboard reaches a row further.
    early = t < 20.0 - 0.5 * BOARDING_S - 0.2
    assert np.allclose(made.columns[column][early], log.columns[column][early], atol=1e-6)
    assert not np.allclose(made.columns[column][~early], log.columns[column][~early], atol=1.0)


def test_wind_on_the_bow_by_hand() -> None:
    log = ferry()
    still = replace(log.measurements, nu=np.zeros_like(log.measurements.nu), eta=np.zeros_like(log.measurements.eta))
    areas = log.profile.wind
    assert areas is not None
    load = wind_load(replace(log, measurements=still), np.array([-5.0, 0.0]))
    # Pressure on the wall that faces it and suction behind: Hoerner's 0.75 and 0.35.
    wanted = -0.5 * 1.225 * 25.0 * areas.frontal_m2 * (0.75 + 0.35 * tanh(3.0))
    assert np.allclose(load, [wanted, 0.0, 0.0], atol=1e-6 * abs(wanted))


def test_a_vessel_that_drifts_with_the_water_feels_none() -> None:
    log = ferry()
    n = len(log.measurements.t)
    drifting = replace(
        log.measurements,
        nu=np.tile([0.3, -0.2, 0.0], (n, 1)),
        eta=np.zeros((n, 3)),
        parts=np.zeros_like(log.measurements.parts),
    )
    adrift = replace(log, measurements=drifting)
    # Of the Munk moment in still water, u v (A22 - A11), nothing is left either.
    M = log.profile.hull.M
    munk = [0.0, 0.0, 0.3 * -0.2 * (M[1, 1] - M[0, 0])]
    assert np.allclose(current_load(adrift, np.array([0.3, -0.2])), munk - damping(adrift, drifting.nu))


def test_roughness_is_a_factor_on_what_is_quadratic() -> None:
    log = ferry()
    nu = log.measurements.nu
    plain, none, double = (damping(log, nu, np.full(3, factor)) for factor in (1.0, 0.0, 2.0))
    assert np.allclose(double - plain, plain - none)
    assert np.allclose(plain, damping(log, nu))
    assert size(plain - none) > 0.1 * size(plain)


def test_waves_are_a_narrow_band() -> None:
    t = np.arange(0.0, 2000.0, 0.1)
    made = series(t, 0.4, np.random.default_rng(4))
    power, f = np.abs(np.fft.rfft(made)) ** 2, np.fft.rfftfreq(len(t), 0.1)
    assert made.std() == pytest.approx(1.0)
    assert float((power * f).sum() / power.sum()) == pytest.approx(0.4, abs=0.02)
    assert power[(f > 0.24) & (f < 0.56)].sum() > 0.99 * power.sum()
    log = ferry()
    force = log.measurements.parts.sum(axis=1)[:, :2]
    truth = concealments()["waves"].sample(0.5, log, np.random.default_rng(), (None, None))
    assert truth.values["force_std"] == pytest.approx(0.5 * np.sqrt(np.mean(force**2)))


def test_a_load_is_shared_by_least_norm(tmp_path: Path) -> None:
    log = ferry()
    load = np.tile([-30.0, 12.0, 40.0], (len(log.measurements.t), 1))
    again = reread(conceal_load(log, load).log, tmp_path)
    more = again.parts - log.measurements.parts
    off = np.abs(more.sum(axis=1)[EDGE:-EDGE] - [30.0, -12.0, -40.0])
    # Between two rows of the record, a force that passes near zero turns faster than lines between them.
    assert np.quantile(off, 0.98) < 0.5
    # Two thrusters on the centreline, as far ahead as astern: half of the force each, and a couple across.
    assert np.allclose(np.median(more[EDGE:-EDGE, :, 0], axis=0), 15.0, atol=0.1)


def test_what_a_thrust_curve_does_not_reach_is_counted() -> None:
    log = ferry()
    far = np.tile([-1e5, 0.0, 0.0], (len(log.measurements.t), 1))
    assert conceal_load(log, far).missed == pytest.approx(1.0)
    assert (
        concealments()["thruster_gain"]
        .conceal(log, Truth("thruster_gain", next(iter(drives(log))), {"factor": 1e-3}), np.random.default_rng())
        .missed
        > 0.5
    )


def test_a_rudder_carries_no_load() -> None:
    for effect in ("payload", "mooring"):
        assert concealments()[effect].cannot(tanker()) == "its actuators cannot push freely in sway and yaw"
    load = np.tile([0.0, 10.0, 0.0], (len(tanker().measurements.t), 1))
    made = conceal_load(tanker(), load)
    assert made.missed == pytest.approx(1.0)
    assert made.why == "its actuators cannot push that way"


def sailed_astern() -> RecordedLog:
    """Return the ferry with records of the first thruster that are negative now and then."""
    log = ferry()
    column = next(iter(drives(log).values())).column
    values = log.columns[column]
    return log.changed({column: np.where(np.arange(len(values)) % 3 == 0, -values, values)})


@pytest.mark.parametrize("one", concealments().values(), ids=lambda one: one.id)
def test_every_concealment(one: Concealment) -> None:
    """Its truth has the parameters that a finding has, and nothing but its own signals changes."""
    log = ferry()
    if one.id == "astern_asymmetry":
        # Its thrusters turn round instead of pushing astern.
        assert one.cannot(log) == "no actuator of it pushes both ways"
        log = sailed_astern()
    assert one.cannot(log) == ""
    least, most = one.sizes(log)
    assert 0.0 < least < most
    truth = one.sample(least, log, np.random.default_rng(3), (None, None))
    assert truth.effect == one.id
    if one.id in effects():
        assert truth.instance in effects()[one.id].instances(log.profile)
        # Of a limit, which is where the motion has it, the size is what the record claims beyond.
        assert set(truth.values) - {"lost"} <= {
            parameter.name for parameter in effects()[one.id].parameters_of(log.profile)
        }
    made = one.conceal(log, truth, np.random.default_rng(3))
    assert made.log is not log
    assert made.missed <= 0.02
    if one.family != SENSOR:
        navigation = log.topics["x"]
        assert made.log.series[navigation] is log.series[navigation]
    changed = [
        name
        for topic, series in made.log.series.items()
        for name, values in series.columns.items()
        if not np.array_equal(values, log.series[topic].columns[name])
        or not np.array_equal(series.receive_ns, log.series[topic].receive_ns)
    ]
    assert changed
