"""Planned trials against the usual one, on simulated vessels whose hull is off from what the plan believes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ferryid.diagnose.data import read_measurements, window_lengths
from ferryid.diagnose.inference import estimation_problem, fit, fitted_force_model, prior_force_model, windows
from ferryid.diagnose.judging import Responses, likeness, together
from ferryid.effects.force_model import hull_of
from ferryid.effects.thresholds import EFFECTS
from ferryid.identifiability.sensors import mapped, reading
from ferryid.identifiability.trial import sailing
from ferryid.planning import PlanSettings, plan
from ferryid.planning.information import information
from ferryid.planning.limits import Limits
from ferryid.planning.segments import segments
from ferryid.planning.waters import Waters
from ferryid.simulate import Scenario, write_log
from ferryid.simulate.sensors import sense
from ferryid.simulate.trial import Simulation, sail
from ferryid.types import IN_MEMORY
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile

FRESH = 1000
"""Number from which on vessels are others than those that the design was looked at with; without pairs, which take longest."""
VESSELS = ("milliampere", "milliampere-2025")
"""Bundled vessels with a hull model that can follow a path."""


@dataclass(frozen=True)
class Found:
    """What came of one vessel.

    Attributes
    ----------
    vessel
        Its profile.
    usual, planned
        Median error of the hull's coefficients after either trial, over their prior standard deviations.
    expected
        Median ratio of the deviations that the plan expected.
    expected_median
        Ratio of the median deviations that it expected, as the errors are compared; deviations in those of the prior.
    pairs
        Pairs of effects of usual size that a straight run leaves unresolved, as ``ferryid diagnose`` states them.
    separated, separated_by_usual
        How many of them are resolved beside that run by a trial that is planned after it, and by the usual one.
    scaled
        Root mean square of the errors after either trial, each over the standard deviation that the estimate states.
    """

    vessel: str
    usual: float
    planned: float
    expected: float
    expected_median: float
    pairs: int
    separated: int
    separated_by_usual: int
    scaled: tuple[float, float]


def study(number: int) -> Found:
    """Return what came of a vessel: a bundled one with every coefficient off as the prior has it, by a seed.

    Pairs are those of the first vessels, below `FRESH`.
    """
    profile = load_profile(VESSELS[number % len(VESSELS)])
    rng = np.random.default_rng(1000 + number)
    true = _off(sailing(profile), rng)
    with TemporaryDirectory() as name:
        folder = Path(name)
        waters = Waters(profile, sailing(profile), frozenset(), folder, 2 * number + 1)
        made = plan(profile, (), PlanSettings(seed=2 * number + 1), IN_MEMORY)
        assert made.track is not None
        usual = _log(waters.twelve_corners(made.duration_s), profile, true, 2 * number + 1, folder / "usual.mcap")
        planned = _log(made.track.scenario, profile, true, 2 * number + 2, folder / "planned.mcap")
        errors, scaled = zip(*(_errors(log, profile, true) for log in (usual, planned)), strict=True)
        deviations = np.array([(one.usual / one.now, one.planned / one.now) for one in made.hull])
        medians = np.median(deviations, axis=0)
        counts = (0, 0, 0)
        if number < FRESH:
            counts = _separated(profile, true, made.track.limits, made.duration_s, number, folder)
    promised = float(medians[1] / medians[0])
    return Found(profile.name, *errors, made.ratio, promised, *counts, scaled)


def _separated(
    profile: Profile, true: Profile, limits: Limits, seconds: float, number: int, folder: Path
) -> tuple[int, int, int]:
    """Return how many pairs a straight run leaves unresolved, and how many a planned and the usual trial after it resolve."""
    seed = 2 * number + 1
    waters = Waters(profile, sailing(profile), frozenset(), folder, seed)
    straight = next(one for one in segments(limits, waters.scale[1]) if one.kind == "run")
    run = _log(waters.following(straight.poses, limits), profile, true, seed, folder / "run.mcap")
    made = plan(_seen(profile), (str(run),), PlanSettings(seed=seed), IN_MEMORY)
    assert made.track is not None
    planned = _log(made.track.scenario, profile, true, seed + 1, folder / "after.mcap")
    usual = _log(waters.twelve_corners(seconds), profile, true, seed + 1, folder / "again.mcap")
    known, *others = (information(str(log), _seen(profile), None) for log in (run, planned, usual))
    left = {frozenset((one.first, one.second)) for one in likeness(together(known)).alike if not one.resolved}

    def resolved(more: list[Responses]) -> int:
        every = likeness(together([*known, *more])).pairs
        return sum(one.resolved for one in every if frozenset((one.first, one.second)) in left)

    return len(left), *map(resolved, others)


def _off(vessel: Profile, rng: np.random.Generator) -> Profile:
    spread = EFFECTS.hull_spread
    M = vessel.hull.M.copy()
    for k in range(3):
        M[k, k] *= 1.0 + spread * rng.standard_normal()
    D = {name: value * (1.0 + spread * rng.standard_normal()) for name, value in vessel.hull.D.items()}
    return replace(vessel, hull=replace(vessel.hull, M=M, D=D))


def _log(scenario: Scenario, profile: Profile, true: Profile, seed: int, path: Path) -> Path:
    truth, control = sail(scenario, sailing(profile), seed, None, true)
    streams = sense(scenario, true, seed, truth, control)
    write_log(Simulation(scenario, seed, true, truth, control, streams), path)
    return path


def _seen(profile: Profile) -> Profile:
    return replace(reading(sailing(profile), mapped(profile)), hull=profile.hull)


def _errors(log: Path, profile: Profile, true: Profile) -> tuple[float, float]:
    """Return the median error of the coefficients over the prior's deviations, and the rms over those that are stated."""
    measurements, _ = read_measurements(str(log), _seen(profile))
    seen = windows(measurements, *window_lengths(profile))
    problem = estimation_problem(seen, *prior_force_model(seen.measurements, profile))
    found = fitted_force_model(problem.plain, fit(problem, ()))
    free = problem.hull_spread > 0.0
    errors = (found.hull - hull_of(true))[free] / problem.hull_spread[free]
    slopes = problem.hull_slopes(found)[:, free]
    stated = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes + np.eye(int(free.sum())))))
    return float(np.median(np.abs(errors))), float(np.sqrt(np.mean((errors / stated) ** 2)))
