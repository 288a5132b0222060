"""A known payload and a measured current, from the message in a log to the report."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from numpy.typing import NDArray
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from scipy.integrate import solve_ivp

from ferryid.compare.evaluation import evaluate
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.models.forces.estimator import Estimator, effective_mass
from ferryid.models.forces.residual import base_force, compute_residual, motion_force
from ferryid.models.prediction.free_run import run_free
from ferryid.report.fit_report import fit_and_report
from ferryid.signals.prepare import prepare
from ferryid.signals.track import Motion
from ferryid.types import RunContext
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Hull

pytestmark = pytest.mark.slow

Floats = NDArray[np.float64]

PROFILE = load_profile("milliampere")
CURVE = (0.0, 2.39675290e-2, 2.13524953e-4, 7.69329924e-7, -1.08151233e-10, -4.09699444e-13)
RATE, SECONDS = 10.0, 240.0
START_NS = 1_700_000_000_000_000_000
MASS_KG, PLACE_M, BOARDING_S = 400.0, 0.8, 120.0


def orders(t: Floats) -> Floats:
    """Speed [rpm] and angle [rad] of both thrusters, shape (n, 4): smooth, and never twice the same."""
    return np.stack(
        [
            450 + 250 * np.sin(0.13 * t) + 100 * np.sin(0.41 * t),
            2.4 * np.sin(0.061 * t) + 0.5 * np.sin(0.37 * t),
            420 + 300 * np.cos(0.11 * t) + 90 * np.sin(0.33 * t),
            2.7 * np.cos(0.073 * t) + 0.4 * np.sin(0.29 * t),
        ],
        axis=-1,
    )


def thrust(t: Floats) -> Floats:
    speed1, angle1, speed2, angle2 = np.moveaxis(orders(t), -1, 0)
    force1, force2 = (np.polynomial.polynomial.polyval(speed, CURVE) for speed in (speed1, speed2))
    surge = force1 * np.cos(angle1) + force2 * np.cos(angle2)
    side1, side2 = force1 * np.sin(angle1), force2 * np.sin(angle2)
    return np.stack([surge, side1 + side2, 1.8 * (side1 - side2)], axis=-1)


@dataclass(frozen=True)
class Trial:
    """States of an independent integration, shape (n, 3), at times `t`."""

    t: Floats
    eta: Floats
    nu: Floats
    nu_dot: Floats
    payload: Floats
    current: Floats

    def motion(self) -> Motion:
        """The trial as measured without error."""
        valid = np.ones(len(self.t), dtype=bool)
        return Motion(
            log="made", t=self.t, rate_hz=RATE, eta=self.eta, nu=self.nu, nu_dot=self.nu_dot, tau=thrust(self.t),
            valid=valid, raw_nu=self.nu, payload=self.payload, current=self.current,
        )  # fmt: skip


def skew(force: Floats, nu: Floats) -> Floats:
    """Rate of change of a momentum [P, Q, R] that turns with the body (Kirchhoff's equations)."""
    p, q, _ = force
    u, v, r = nu
    return np.array([-r * q, r * p, u * q - v * p])


def sailed(hull: Hull, payload: Callable[[float], tuple[float, float]], current: tuple[float, float]) -> Trial:
    """Integrate Kirchhoff's equations with SciPy: momenta of body, payload and water, nothing of ours."""
    rigid = np.array([[hull.mass_kg, 0, 0], [0, hull.mass_kg, 0], [0, 0, hull.inertia_z]])
    added = hull.M - rigid
    symmetric = (added + added.T) / 2
    D = hull.D

    def damping(nu: Floats) -> Floats:
        u, v, r = nu
        return np.array(
            [
                (-D["X_u"] - D["X_|u|u"] * abs(u) - D["X_uuu"] * u * u) * u,
                (-D["Y_v"] - D["Y_|v|v"] * abs(v) - D["Y_|r|v"] * abs(r) - D["Y_vvv"] * v * v) * v
                + (-D["Y_r"] - D["Y_|v|r"] * abs(v) - D["Y_|r|r"] * abs(r)) * r,
                (-D["N_v"] - D["N_|v|v"] * abs(v) - D["N_|r|v"] * abs(r)) * v
                + (-D["N_r"] - D["N_|v|r"] * abs(v) - D["N_|r|r"] * abs(r) - D["N_rrr"] * r * r) * r,
            ]
        )

    def derivative(t: float, state: Floats) -> Floats:
        psi, nu = state[2], state[3:]
        c, s = np.cos(psi), np.sin(psi)
        m, x = payload(t)
        body = rigid + np.array([[m, 0, 0], [0, m, m * x], [0, m * x, m * x * x]])
        flow = np.array([c * current[0] + s * current[1], -s * current[0] + c * current[1], 0.0])
        flow_dot = nu[2] * np.array([flow[1], -flow[0], 0.0])
        through = nu - flow
        rest = thrust(np.array(t)) - skew(body @ nu, nu) - skew(symmetric @ through, through) - damping(through)
        nu_dot = np.linalg.solve(body + added, rest + added @ flow_dot)
        return np.array([c * nu[0] - s * nu[1], s * nu[0] + c * nu[1], nu[2], *nu_dot])

    t = np.arange(0.0, SECONDS, 1.0 / RATE)
    first = t < BOARDING_S
    # A boarding is a step: integrated up to it and on from it.
    before = solve_ivp(
        derivative, (0.0, BOARDING_S), np.zeros(6), t_eval=[*t[first], BOARDING_S], rtol=1e-9, atol=1e-10
    )
    after = solve_ivp(derivative, (BOARDING_S, SECONDS), before.y[:, -1], t_eval=t[~first], rtol=1e-9, atol=1e-10)
    path = np.hstack([before.y[:, :-1], after.y]).T
    aboard = np.array([payload(at) for at in t])
    nu_dot = np.array([derivative(at, state)[3:] for at, state in zip(t, path, strict=True)])
    return Trial(t, path[:, :3], path[:, 3:], nu_dot, aboard, np.tile(current, (len(t), 1)))


def boarding(t: float) -> tuple[float, float]:
    return (MASS_KG, PLACE_M) if t >= BOARDING_S else (0.0, 0.0)


@pytest.fixture(scope="module")
def boarded() -> Trial:
    return sailed(PROFILE.hull, boarding, (0.0, 0.0))


@pytest.fixture(scope="module")
def drifted() -> Trial:
    return sailed(PROFILE.hull, lambda _: (250.0, -0.6), (0.3, -0.2))


def write(trial: Trial, path: Path, *, payload: bool = True, current: bool = True) -> str:
    """Write a trial as a ROS1 bag with milliAmpère's topics; payload every two seconds, current every second."""
    ros = get_typestore(Stores.ROS1_NOETIC)
    header = "std_msgs/Header header\n"
    for name, fields in (("ThrusterState", "speed azimuth"), ("Current", "north east"), ("Payload", "mass x")):
        text = header + "".join(f"float64 {one}\n" for one in fields.split())
        ros.register(get_types_from_msg(text, f"ferry_msgs/msg/{name}"))
    make = ros.types
    steps = orders(trial.t)

    def odometry(k: int, head: object) -> object:
        north, east, psi = trial.eta[k]
        u, v, r = trial.nu[k]
        vector, none = make["geometry_msgs/msg/Vector3"], np.zeros(36)
        turned = make["geometry_msgs/msg/Quaternion"](0.0, 0.0, np.sin(psi / 2), np.cos(psi / 2))
        pose = make["geometry_msgs/msg/Pose"](make["geometry_msgs/msg/Point"](north, east, 0.0), turned)
        twist = make["geometry_msgs/msg/Twist"](vector(u, v, 0.0), vector(0.0, 0.0, r))
        return make["nav_msgs/msg/Odometry"](
            head,
            "base_link",
            make["geometry_msgs/msg/PoseWithCovariance"](pose, none),
            make["geometry_msgs/msg/TwistWithCovariance"](twist, none),
        )

    def values(kind: str, rows: Floats) -> Callable[[int, object], object]:
        return lambda k, head: make[kind](head, *rows[k].tolist())

    topics = [
        ("/navigation/odometry", "nav_msgs/msg/Odometry", 1, odometry),
        ("/thruster1/state", "ferry_msgs/msg/ThrusterState", 1, values("ferry_msgs/msg/ThrusterState", steps[:, :2])),
        ("/thruster2/state", "ferry_msgs/msg/ThrusterState", 1, values("ferry_msgs/msg/ThrusterState", steps[:, 2:])),
    ]
    if payload:
        topics.append(
            ("/payload/waterline", "ferry_msgs/msg/Payload", 20, values("ferry_msgs/msg/Payload", trial.payload))
        )
    if current:
        topics.append(
            ("/weather/current", "ferry_msgs/msg/Current", 10, values("ferry_msgs/msg/Current", trial.current))
        )
    with Writer(path) as writer:
        links = [writer.add_connection(topic, kind, typestore=ros) for topic, kind, _, _ in topics]
        for k, at in enumerate(trial.t):
            time_ns = START_NS + round(at * 1e9)
            head = make["std_msgs/msg/Header"](k, make["builtin_interfaces/msg/Time"](*divmod(time_ns, 10**9)), "")
            for link, (_, kind, every, message) in zip(links, topics, strict=True):
                if k % every == 0:
                    writer.write(link, time_ns, ros.serialize_ros1(message(k, head), kind))
    return str(path)


def test_a_payload_takes_exactly_the_force_of_a_heavier_hull() -> None:
    rng = np.random.default_rng(1)
    nu, nu_dot, psi = rng.normal(size=(60, 3)), rng.normal(size=(60, 3)), rng.uniform(-3, 3, 60)
    m, x = 333.0, -1.1
    more = np.array([[m, 0, 0], [0, m, m * x], [0, m * x, m * x * x]])
    heavier = replace(PROFILE, hull=replace(PROFILE.hull, M=PROFILE.hull.M + more))
    load = np.tile([m, x], (60, 1))
    np.testing.assert_allclose(
        motion_force(PROFILE, {}, nu_dot, nu, psi, payload=load),
        motion_force(heavier, {}, nu_dot, nu, psi),
        rtol=1e-12,
        atol=1e-8,
    )


def test_a_payload_is_known_so_that_delta_leaves_it_and_the_measured_force_takes_zeta() -> None:
    nu, nu_dot, load = np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]), np.array([[200.0, 0.0]])
    scale = {"delta": 0.4, "zeta": 2.0}
    bare = motion_force(PROFILE, scale, nu_dot, nu, np.zeros(1))
    loaded = motion_force(PROFILE, scale, nu_dot, nu, np.zeros(1), payload=load)
    np.testing.assert_allclose(loaded - bare, [[100.0, 0.0, 0.0]])


def test_a_payload_feels_no_current_and_drifts_without_force(drifted: Trial) -> None:
    motion = drifted.motion()
    # The printed m23 and m32 differ; Kirchhoff's symmetric mean is what turns, as in (2.8).
    np.testing.assert_allclose(compute_residual(PROFILE, motion, {}), 0.0, atol=1e-8)
    assert np.abs(compute_residual(PROFILE, replace(motion, current=None), {})).max() > 40.0


@pytest.mark.parametrize("form", ["measured", "parallel"])
def test_known_it_leaves_nothing_and_unknown_its_mass(boarded: Trial, form: str) -> None:
    motion = boarded.motion()
    away = np.abs(motion.t - BOARDING_S) > 2.0
    known = compute_residual(PROFILE, motion, {}, form)
    rows = away & np.isfinite(known).all(axis=1)
    assert rows.sum() > 2000
    np.testing.assert_allclose(known[rows], 0.0, atol=1e-8 if form == "measured" else 1.5)
    # At the boarding itself too.
    assert np.nanmax(np.abs(known)) < 1.5
    missed = compute_residual(PROFILE, replace(motion, payload=None), {}, form)
    late = rows & (motion.t > BOARDING_S)
    _, v, r = motion.nu[late].T
    felt = motion.nu_dot[late, 0] - v * r - PLACE_M * r**2
    assert missed[late, 0] @ felt / (felt @ felt) == pytest.approx(MASS_KG, rel=0.03)
    np.testing.assert_allclose(missed[rows & (motion.t < BOARDING_S)], known[rows & (motion.t < BOARDING_S)], atol=1e-9)


def test_a_payload_that_is_unknown_for_a_row_gives_no_residual_there(boarded: Trial) -> None:
    motion = boarded.motion()
    load = motion.payload.copy() if motion.payload is not None else np.empty(0)
    load[500] = np.nan
    holed = replace(motion, payload=load)
    assert np.flatnonzero(np.isnan(compute_residual(PROFILE, holed, {})).any(axis=1)).tolist() == [500]
    lost = np.isnan(compute_residual(PROFILE, holed, {}, "parallel")).any(axis=1)
    assert np.flatnonzero(lost[100:900]).tolist() == list(range(396, 406))


def test_runs_free_with_the_payload_that_was_aboard(boarded: Trial, drifted: Trial) -> None:
    for trial in (boarded, drifted):
        motion = trial.motion()
        run = run_free(Estimator(PROFILE, {}), [motion], [motion.valid])
        assert run.starts > 10
        assert np.all(run.position_m < 0.05)
        assert np.all(run.heading_rad < 0.01)
        blind = run_free(Estimator(PROFILE, {}), [replace(motion, payload=None)], [motion.valid])
        assert blind.position_m[-1] > 10 * run.position_m[-1]


def test_a_force_without_the_payload_argument_still_runs_free(drifted: Trial) -> None:
    motion = replace(drifted.motion(), payload=None, current=None)
    own = Estimator(PROFILE, {})
    run = run_free(lambda a, b, c, d, e: own(a, b, c, d, e), [motion], [motion.valid])
    assert run.starts > 10


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory, boarded: Trial, drifted: Trial) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("logs")
    return {
        "boarded": write(boarded, folder / "boarded.bag", current=False),
        "unweighed": write(boarded, folder / "unweighed.bag", payload=False, current=False),
        "drifted": write(drifted, folder / "drifted.bag"),
    }


SETTINGS = FitSettings(delta=0.6, components=18, window_s=0.5, draws=20, accept="thesis")


def test_a_fit_recovers_the_bare_hull_only_where_the_payload_is_weighed(logs: dict[str, str], tmp_path: Path) -> None:
    masses = {}
    for name in ("boarded", "unweighed"):
        result = fit_logs([logs[name]], PROFILE, SETTINGS, RunContext(tmp_path))
        masses[name] = effective_mass(PROFILE, result.model.scale, result.model.terms, result.model.theta)
        assert ("payload_kg" in result.model.ranges) == (name == "boarded")
    true = np.diag(PROFILE.hull.M)
    np.testing.assert_allclose(np.diag(masses["boarded"]) / true, 1.0, atol=0.02)
    # Half the rows carry 400 kg.
    assert masses["unweighed"][0, 0] - true[0] > 100.0


def test_prepared_log_holds_the_messages(logs: dict[str, str], tmp_path: Path, drifted: Trial) -> None:
    motion = prepare(logs["drifted"], PROFILE, tmp_path, window_s=0.5).motion
    assert motion.payload is not None
    assert motion.current is not None
    np.testing.assert_allclose(motion.payload[motion.valid], np.tile([250.0, -0.6], (motion.valid.sum(), 1)))
    np.testing.assert_allclose(motion.current[motion.valid], np.tile([0.3, -0.2], (motion.valid.sum(), 1)))
    assert "Payload: 250 kg at x = -0.60 m, which the model knows as mass." in motion.repairs
    error = motion.tau - base_force(PROFILE, motion, {})
    assert np.sqrt(np.mean(error[motion.valid] ** 2)) < 3.0


def conforms(data: dict, name: str) -> None:
    schema = json.loads(files("ferryid.schemas").joinpath(f"{name}.json").read_text(encoding="utf-8"))
    jsonschema.validate(data, schema)


def test_current_and_payload_reach_basis_report_and_json(logs: dict[str, str], tmp_path: Path) -> None:
    outcome = fit_and_report([logs["drifted"]], PROFILE, SETTINGS, RunContext(tmp_path))
    model = outcome.stored.model
    assert model.settings["basis"] == "modulus+current-thesis"
    assert outcome.accepted
    assert model.ranges["payload_kg"] == (250.0, 250.0)
    conforms(outcome.json, "fit")
    load = outcome.json["logs"][0]["streams"]["/payload/waterline"]["signals"]["payload_kg"]
    assert (load["minimum"], load["maximum"], load["unit"]) == (250.0, 250.0, "kg")
    page = outcome.report.read_text(encoding="utf-8")
    assert "Payload: 250 kg at x = -0.60 m" in page
    assert "current, payload" in page
    assert "<td>payload_kg</td><td>250</td><td>250</td>" in page
    judged = evaluate(model, [logs["drifted"]], RunContext(tmp_path))
    conforms(judged, "evaluate")
    assert judged["logs"][0]["outside"]["payload_kg"] == 0.0
    assert judged["logs"][0]["normalised_mse"] < 0.01


def test_what_is_not_weighed_is_told(logs: dict[str, str], tmp_path: Path) -> None:
    result = fit_logs([logs["drifted"], logs["unweighed"]], PROFILE, SETTINGS, RunContext(tmp_path))
    assert any("1 of 2 logs has no payload measured" in warning for warning in result.warnings)
    (entry,) = evaluate(result.model, [logs["unweighed"]], RunContext(tmp_path))["logs"]
    assert any("this log has none: it is taken as empty" in warning for warning in entry["warnings"])
