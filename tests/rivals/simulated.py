"""Simulated trials with a known truth: of the simulator, and of an independent plant in six degrees of freedom."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.identify.fit_data import Coefficients
from ferryid.models.forces import ACCELERATIONS, Estimator, effective_mass, motion_force
from ferryid.signals.prepare import Opened, open_track
from ferryid.simulate import load_scenario, simulate, write_log
from ferryid.simulate.plant.hull import perturbed
from ferryid.simulate.sections import Wind
from ferryid.types import Floats
from ferryid.validation import log_writer
from ferryid.validation.plant.air import air_constants, air_load
from ferryid.validation.plant.hull import drag, hull_constants
from ferryid.validation.plant.trial import simulate_trial
from ferryid.validation.plant.vessels import FERRY
from ferryid.validation.prior_profile import masses, profile_text
from ferryid.vessel import load_profile, parse_profile
from ferryid.vessel.parse_hull import DAMPING_TERMS
from ferryid.vessel.profile import Profile
from ferryid.vessel.wind import relative_wind_force
from tests.rivals.methods import METHODS, Method
from tests.rivals.scores import HORIZONS_S, free_runs
from tests.rivals.task import Task
from tests.rivals.variants import VARIANTS

DRAWS = 200
"""Draws of the bootstrap of ferryid's intervals."""
WIND_MPS, GUST_MPS = (-2.0, 2.0), 0.5
"""The breeze, which nothing measures: where it goes to, north and east, and the standard deviation of its gusts."""
VARIED_TRIALS = 3
"""Trials of each kind on which the variants of the weak form are tried: they take as long as all methods together."""
INERTIAS = ("m11", "m22", "m33")


@dataclass(frozen=True)
class Kind:
    """Kind of trial: its name, the plant, by how much each coefficient of the hull is off, and whether a breeze blows."""

    plant: str
    off: float
    breeze: bool

    @property
    def name(self) -> str:
        """Name on the page."""
        return f"{self.plant}, hull {100 * self.off:.0f} % off, {'breeze' if self.breeze else 'calm'}"


KINDS = tuple(
    Kind(plant, off, breeze)
    for plant in ("simulator", "independent plant")
    for off in (0.1, 0.4)
    for breeze in (False, True)
)


@dataclass(frozen=True, eq=False)
class Trial:
    """A log to learn from, one of the same vessel in calm without noise to judge on, the profile, and the truth.

    `mass` is (3, 3); `damping` gives the true damping force of velocities (n, 3), shape (n, 3).
    """

    profile: Profile
    learn: Opened
    judge: Opened
    mass: Floats
    hull: Profile | None

    def damping(self, nu: Floats) -> Floats:
        """Return the force against the damping of water and still air, shape (n, 3).

        Of the two a log without a measured wind shows the sum, and the damping of every method is that sum.
        """
        if self.hull is not None:
            assert self.hull.wind is not None
            water = damping_force(Estimator(self.hull, {}), self.mass, nu)
            return water - relative_wind_force(self.hull.wind, nu[:, 0], nu[:, 1])
        hull, air, force = hull_constants(FERRY), air_constants(FERRY), np.zeros((len(nu), 6))
        for row, (u, v, r) in enumerate(nu):
            drag(hull, np.array([u, v, 0.0, 0.0, 0.0, r]), 0.0, 1.0, force[row])
            air_load(air, -u, -v, force[row])
        return -force[:, [0, 1, 5]]


@dataclass(frozen=True, eq=False)
class Found:
    """What a method found in one trial.

    Attributes
    ----------
    inertia
        Relative errors of m11, m22 and m33, shape (3,).
    damping
        Root mean square error of the damping force at the trial's velocities over that of the true one, mean of the axes.
    covered
        Whether the 95 % intervals of the three inertias hold the truth; NaN where there is none, shape (3,).
    runs
        Errors of free runs in the other log, as of `tests.rivals.scores.Score`.
    seconds
        Time that the estimate took, its intervals included [s].
    expected
        What `damping` is to be expected by the covariance of the estimate and the terms; NaN without one.
    """

    inertia: Floats
    damping: float
    covered: Floats
    runs: Floats
    seconds: float
    expected: float = float("nan")


Findings = dict[str, Found | str]
"""What every method found in a trial, or why it found no model."""


def damping_force(force: Estimator, mass: Floats, nu: Floats) -> Floats:
    """Return a model's force for steady velocities without its intercept and the Coriolis force of a mass, shape (n, 3)."""
    zero = np.zeros_like(nu)
    whole = force(zero, nu, zero[:, 0], None, None)
    if force.intercept is not None:
        whole = whole - force.intercept
    bare = replace(force.profile, hull=replace(force.profile.hull, M=mass, D={}))
    return np.asarray(whole - motion_force(bare, {}, zero, nu, zero[:, 0]))


def trial(kind: Kind, seed: int, folder: Path) -> Trial:
    """Return a trial of a kind."""
    # Logs of one plant, seed and weather serve every kind: only the profile differs.
    where = folder / kind.plant.replace(" ", "-")
    where.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([seed, round(100 * kind.off)])
    names = (*INERTIAS, *DAMPING_TERMS)
    factors = dict(zip(names, (1.0 + kind.off * rng.choice([-1.0, 1.0], len(names))).tolist(), strict=True))
    return (_simulator if kind.plant == "simulator" else _independent)(kind, seed, factors, where)


def _simulator(kind: Kind, seed: int, factors: Mapping[str, float], folder: Path) -> Trial:
    true = load_profile("milliampere")
    profile = replace(true, hull=perturbed(true.hull, factors))
    calm = load_scenario("twelve-corner-calm")
    calm = replace(calm, sensors=replace(calm.sensors, reference_rate_hz=calm.sensors.navigation_rate_hz))
    blown = replace(
        calm, wind=Wind(north_mps=WIND_MPS[0], east_mps=WIND_MPS[1], gust_std_mps=GUST_MPS, gust_time_s=8.0)
    )
    noise = replace(calm.sensors.noise, position_m=0.0, heading_deg=0.0, velocity_mps=0.0, yaw_rate_degps=0.0)
    exact = replace(calm, sensors=replace(calm.sensors, noise=noise))
    logs = []
    learn = ("breeze", blown) if kind.breeze else ("calm", calm)
    for (name, scenario), number in ((learn, seed), (("judge", exact), 1000 + seed)):
        path = folder / f"{name}-{seed}.mcap"
        if not path.exists():
            write_log(simulate(scenario, number), path, overwrite=True)
        logs.append(open_track(str(path), profile, None))
    return Trial(profile, *logs, true.hull.M, true)


def _independent(kind: Kind, seed: int, factors: Mapping[str, float], folder: Path) -> Trial:
    profile = parse_profile(profile_text(FERRY, factors, FERRY.thrusters), "ferry")
    logs = []
    for name, number in (("breeze" if kind.breeze else "calm", seed), ("judge", 1000 + seed)):
        conditions: dict[str, object] = {"noise": 0.0} if name == "judge" else {}
        if name == "breeze":
            conditions["wind"] = WIND_MPS
        path = folder / f"{name}-{seed}.mcap"
        if not path.exists():
            trial = simulate_trial(FERRY, conditions, "calibration", number)
            path = log_writer.write_log(log_writer.streams(trial, number), folder, path.stem, "mcap")
        logs.append(open_track(str(path), profile, None))
    m = masses(FERRY)
    mass = np.array([[m["m11"], 0.0, 0.0], [0.0, m["m22"], m["m23"]], [0.0, m["m32"], m["m33"]]])
    return Trial(profile, *logs, mass, None)


def compared(trial: Trial, methods: Mapping[str, Method] = METHODS, draws: int = DRAWS) -> Findings:
    """Return what each method found in a trial, or why it found no model."""
    task, test = Task.of(trial.profile, [trial.learn]), Task.of(trial.profile, [trial.judge])
    nu = np.concatenate([m.nu[m.valid] for m in task.data.motions])[::10]
    true = trial.damping(nu)
    told: dict[str, Found | str] = {}
    for name, method in methods.items():
        began = time.perf_counter()
        try:
            found = method(task, draws)
        except FerryIdError as error:
            told[name] = str(error)
            continue
        seconds = time.perf_counter() - began
        mass = effective_mass(trial.profile, task.settings.scale, task.functions.terms, found.theta)
        inertia = np.diag(mass) / np.diag(trial.mass) - 1.0
        if np.linalg.eigvalsh((mass + mass.T) / 2).min() <= 0.0:
            told[name] = "mass matrix not positive"
            continue
        error = np.sqrt(np.mean((damping_force(task.estimator(found), mass, nu) - true) ** 2, axis=0))
        share = float(np.mean(error / np.sqrt(np.mean(true**2, axis=0))))
        runs = free_runs(task, test, found)
        told[name] = Found(
            inertia, share, covered(task, found, trial.mass), runs, seconds, expected_damping(task, found, nu, true)
        )
    return told


def try_one(kind: Kind, seed: int, folder: Path) -> tuple[Findings, Findings]:
    """Return what the methods find in a trial of a kind, and the variants in the first few."""
    one = trial(kind, seed, folder)
    return compared(one), compared(one, VARIANTS, 0) if seed < VARIED_TRIALS else {}


def covered(task: Task, found: Coefficients, mass: Floats) -> Floats:
    """Return whether the intervals of the three inertias hold the truth, 1 or 0, NaN where there is none, shape (3,)."""
    base, out = np.diag(task.windows.base_mass), np.full(3, np.nan)
    for axis, name in enumerate(("u_dot", "v_dot", "r_dot")):
        row = task.functions.terms.index(name)
        low, high = base[axis] + found.low[row, axis], base[axis] + found.high[row, axis]
        if np.isfinite(low + high):
            out[axis] = float(low <= mass[axis, axis] <= high)
    return out


def expected_damping(task: Task, found: Coefficients, nu: Floats, true: Floats) -> float:
    """Return what error of the damping force is to be expected, over its size; mean of the axes.

    The standard error by the covariance of the estimate, which is that of the posterior, and what the nearest of all
    combinations of the terms leaves of the true force: no method with these terms, windows and prior is to have less.
    """
    terms = task.functions.terms
    if not np.isfinite(found.covariance).all() or task.functions.needs_wind or task.functions.needs_current:
        return float("nan")
    functions = task.functions.evaluate(nu, np.zeros_like(nu), None, None)
    at = functions.copy()
    # The Coriolis force goes with the mass, whose error is none of the damping's.
    at[:, [k for k, name in enumerate(terms) if name in (*ACCELERATIONS, "uv", "ur", "vr", "rr")]] = 0.0
    K = len(terms)
    variance = np.einsum("nk,akl,nl->a", at, found.covariance[:, :K, :K], at) / len(at)
    for axis, own in enumerate(task.functions.mask.T):
        columns = functions[:, own]
        nearest = columns @ np.linalg.lstsq(columns, true[:, axis], rcond=None)[0]
        variance[axis] += np.mean((true[:, axis] - nearest) ** 2)
    return float(np.mean(np.sqrt(variance) / np.sqrt(np.mean(true**2, axis=0))))


def summary(every: Sequence[Found | str]) -> list[float]:
    """Return errors of three inertias and damping [%], coverage [%], position error [m], failures and time [s]; medians."""
    good = [one for one in every if not isinstance(one, str)]
    failed = len(every) - len(good)
    if not good:
        return [float("nan")] * 6 + [failed, float("nan")]
    inertia = 100.0 * np.median(np.abs([one.inertia for one in good]), axis=0)
    held = np.concatenate([one.covered for one in good])
    held = held[np.isfinite(held)]
    position = np.concatenate([one.runs[:, len(HORIZONS_S) - 1, 0] for one in good])
    return [
        *inertia.tolist(),
        100.0 * float(np.median([one.damping for one in good])),
        100.0 * float(np.mean(held)) if len(held) else float("nan"),
        float(np.median(position[~np.isnan(position)])),
        failed,
        float(np.mean([one.seconds for one in good])),
    ]
