"""Every threshold has a unit, a meaning and a basis, its page is up to date, and no decision rests on a number elsewhere."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from dataclasses import Field, fields
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid.thresholds import BASES
from tests.docs.pages import ROOT
from tests.docs.thresholds import PAGE, page, stages

PACKAGES = ("signals", "draft", "effects", "regression", "models", "identify", "compare", "diagnose")
"""Packages that decide by thresholds."""
NO_DECISION = {
    "constants of nature, of mathematics and of units": """
        signals.sampling GRAVITY
        signals.time_ranges _DAY_S
        signals.kalman WINDOW_PER_TIME
        draft.write USUAL_THRUST
        draft.unnamed _UNITS
        effects.payload WATER WATERPLANE
        effects.wind_loads EIGHTH SIXTEENTH THREE_SIXTEENTHS TANGENT_EIGHTH
        diagnose.data.course NORMAL
        identify.adaptive.averaging NORMAL_95
        diagnose.second_sources.comparison NORMAL_95
        diagnose.second_sources.samples _TURN
        identify.free_run_checks _DEGREES
        diagnose.judging.group_loads BONFERRONI
        identify.split _GOLDEN
    """,
    "indices, labels, exponents and neutral values": """
        signals.smooth _AXIS_OF
        draft.servo_functions _STEERING _THROTTLE _LEFT _RIGHT _BOAT _RELAY
        draft.actuators USUAL_PULSES_US
        diagnose.checks.kinematics SCALE ANGLE X Y LATE NORTH EAST NEUTRAL
        diagnose.checks.heading_rounding AROUND SAME_RAD
        diagnose.checks.yaw_rate_scale NEUTRAL SIZE
        diagnose.data.measurements CHANNELS
        diagnose.second_sources.fit SCALE ANGLE X Y LATE BIAS BIAS_2 NEUTRAL OF_VECTORS OF_SCALARS FLOORS
        diagnose.second_sources.pairs NORTH EAST PSI U V R
        diagnose.inference.kalman CHANNEL_STATES DIFFUSE
        diagnose.inference.motion_responses VAGUE
        effects.effect HELD
        effects.equations_of_motion MASSES DAMPED PRODUCTS PRODUCT_OF AHEAD
        effects.force_model _NO_FLOW _NO_LOAD _NO_FACTOR _ONE_WIND
        diagnose.inference.noise_estimation GROUPS
        regression.bases.term SURGE SWAY YAW DIMENSIONS
        regression.cross_validation.block_sums OUT
    """,
    "shapes of formulas, and priors of parameters": """
        diagnose.inference.campaign_estimation SCALE_GAPS
        diagnose.inference.group_differences SCATTERS
        diagnose.judging.sensor_differences SCATTERS WIDEST_OF_ERRORS WIDEST_SEEN SIZES
        effects.shallow_water EDGE_M
        effects.thruster_gain LEAST_LEVEL
        effects.thruster_interaction SQUARINGS
        effects.dead_band RISE SIZE LARGEST DIRECT_MPS2 DIRECT_LARGEST_MPS2
        effects.external_push USUAL_MPS2 ARM
        effects.thrust_saturation ROUNDING SIZE START LOWEST
        effects.ventilation WIDTH
        effects.waves USUAL_HZ USUAL_M
        effects.wind COEFFICIENTS
    """,
    "rounding, overflow and division by zero": """
        diagnose.judging.free_runs DIVERGED
        regression.window_shares VARIES
        effects.wind_loads LEAST
        signals.grid EXACT_S
        diagnose.second_sources.comparison _SAME
        diagnose.second_sources.samples _ROUNDING
        diagnose.inference.campaign SAME
        signals.feedback SAME
        diagnose.judging.responses ROUNDING
        diagnose.inference.coloured_noise LEAST_VARIANCE
        identify.acceptance _ROUNDING _NOTHING
        identify.inertia.checks _ROUNDING
        identify.adaptive.averaging _SUM
        regression.bases.crossflow_integrals LEAST_SPEED_MPS
        regression.cross_products LARGEST
        draft.unnamed _ROUNDING
        regression.nipals TOLERANCE _EXHAUSTED
        regression.recurrence EXHAUSTED
        regression.resampling.confidence_set ALIKE
        regression.resampling.paired_bootstrap NOTHING
    """,
    "rates, windows and orders of processing: how finely signals and forces are seen": """
        draft.samples GRID_HZ SMOOTHED_S _SMOOTHED_PERIODS
        draft.actuators _AT_ONCE_S _LAGS_S
        signals.align RATE_LIMIT_HZ
        signals.kalman _LONGEST_S
        signals.smooth _POLYNOMIAL
        signals.complementary_filter CUBIC_S SLOW_S
        diagnose.data.measurements MEAN_S STRIDES
        regression.test_function STRIDES
        diagnose.data.path_comparison RATE_HZ
        diagnose.checks.spans LENGTH_S STRIDE_S RATE_HZ
        diagnose.checks.kinematics DERIVATIVE_S
        diagnose.inference.autoregression ORDER
        diagnose.inference.coloured_noise ORDER PAIRS
        diagnose.inference.weak_form STEPS_A_WINDOW FORCES_HZ LEAST_ROWS
        regression.window_shares SHORTER
        diagnose.inference.spectra WINDOW_RATIO BURST_HZ BURST_S BURST_PERIODS BANDS_HZ
        compare.replay JUDGED_S
        identify.free_run_checks JUDGED_S
        identify.settings TEST_WINDOW_S
        models.forces.residual HORIZON_S
        models.prediction.free_run HORIZONS_S STEP_S
    """,
    "steps, starts, grids and bounds of searches and iterations": """
        diagnose.second_sources.comparison ALIGNMENTS _ALIGNED_S BLOCKS_S
        diagnose.second_sources.fit TINY STEPS LONGER
        signals.kalman _GRID
        signals.poses _AHEAD
        diagnose.checks.azimuth_resolution TURNS
        diagnose.checks.contradiction SHIFTS_S MOST_ACTUATORS
        diagnose.checks.kinematics SIZE TINY_S STEPS
        diagnose.checks.pooling ROUNDS
        diagnose.judging.campaign_split ROUNDS
        diagnose.inference.campaign_estimation ROUNDS SETTLED CONVERGED_GAIN RELAXATION KEPT_SLOPES
        diagnose.inference.campaign_course KNOTS_A_MEMORY MOST_KNOTS
        diagnose.inference.campaign_model DIFFERENCE_STEP
        diagnose.inference.campaign_estimation STARTS BEARINGS STEADY_SHARE HALVINGS SEARCHES CLEARLY_BETTER SCALE_ROUNDS
        diagnose.inference.campaign_properties WEIGHED WORTH
        diagnose.inference.candidate START_SHARES
        effects.actuator_force _NODES
        effects.dead_band NODES
        diagnose.inference.change_points LEVELS
        diagnose.inference.estimation MAX_ITERATIONS HULL_SLOPE_ITERATIONS CONVERGED_GAIN HULL_DIFFERENCE DAMPINGS
        diagnose.inference.estimation PARAMETER_DIFFERENCE LONGEST_STEP
        diagnose.judging.held_out IMITATION_STEPS IMITATION_DIFFERENCE
        diagnose.inference.kalman CONVERGED FEW WIDE
        diagnose.inference.noise_estimation START_SHARES DIFFERENCE_STEP FIRST_DAMPING LEAST_DAMPING LARGEST_DAMPING
        diagnose.inference.noise_estimation LONGEST_STEP SUFFICIENT_GAIN SCREENED_GAIN SEARCHED_STEPS
        diagnose.inference.onset_estimation FIRST_TIME_STEP_S LAST_TIME_STEP_S COMPARING_ITERATIONS LIKELIER
        diagnose.inference.profile_likelihood FIRST_STEP STEP_GROWTH LARGEST_FALL MOST_REFINEMENTS QUANTILES
        diagnose.inference.search COARSE_ITERATIONS
        diagnose.inference.stochastic_disturbance START_STRENGTHS START_FREQUENCIES GIVEN_WAY GROWTH_ROUNDS
        diagnose.inference.disturbance_course GROWTHS FINEST_FACTOR GROWTH_DIFFERENCE
        diagnose.judging.findings TIME_FIT
        diagnose.judging.time_posterior TIME_STEP LONGEST_STEP TIME_FINE_S TIMES_AT_ONCE BENT_SHARE LARGEST_SHARE
        diagnose.judging.campaign_split WEIGHED
        effects.gusts DIFFERENCE_MPS
        effects.linear_evidence DIFFERENCE_STEP
        effects.shallow_water CELLS
        effects.wind SPEEDS_MPS BEARINGS MEAN_GUSTS MEAN_WEIGHTS
        identify.feasible _ROUNDS _SHARES _DIRECTIONS _TIE_STEPS
        identify.log_conditions _DIRECTIONS _SPEEDS
        identify.condition_estimation STEPS _FIRST_STEADY
        identify.condition_kinds _STEP
        identify.settings WINDOWS_S
        models.forces.residual _PASSES
        regression.nipals MOST_ITERATIONS
        regression.random_effects _GOLDEN _REFINEMENTS _RIDGE _SPREADS
    """,
    "sizes: rows held at once, draws, folds, bins, and how much is shown": """
        signals.copies SAMPLES ROWS TRIED MARKS
        identify.weak_rows _CHUNK_WINDOWS
        regression.test_function _CHUNK_WINDOWS
        identify.shared_rows MOST_ROWS
        diagnose.judging.learning MOST_ROWS_AT_ONCE
        signals.kalman _LEAST_ROWS _FIT_ROWS
        signals.poses _STEPS_SAID
        signals.quality _MEDIAN_OF
        signals.render _FIELDS_SHOWN
        draft.samples MOST_ROWS
        draft.autopilots _MOST
        draft.unnamed _MOST _MOST_READINGS _MOST_ROWS
        draft.control_allocation _MOST
        draft.servo_functions _OUTPUTS
        draft.autopilot_parameters SHOWN_CHANGES
        draft.actuator_fields _MOST_SHARED
        diagnose.inference.campaign_logs MOST_ROWS
        diagnose.inference.folds DRAWS
        diagnose.inference.onset_estimation MOST_VALUES LATER_BLOCKS FINE_TIMES
        diagnose.inference.simulation_baseline SHOWN_ROWS
        diagnose.judging.error_profiles SECTORS SPEEDS PLACES TIMES
        diagnose.gathering SHOWN_OVERLAPS
        diagnose.judging.findings SHOWN_RIVALS
        diagnose.judging.unexplained SPANS
        identify.archive MOST_DRAWN
        identify.block_sum_store _VELOCITIES
        identify.excitation SECTORS
        identify.sign_changes MOST_NAMED
        identify.gusts _PROBES MANY_WINDOWS
        identify.weak_archive _AT_A_TIME
        identify.log_conditions _START_WINDOWS
        identify.window_loads _SAMPLES
        identify.condition_choice _GROUPS
        identify.condition_kinds _POINTS
        identify.condition_problem BLOCKS STEADY
        identify.physical_checks MOST_ROWS
        identify.settings FOLDS
        identify.split EVERY
        identify.sweeps.structure_ranking DRAWS
        identify.sweeps.weak_sweep USUAL _WINDOWS_A_FOLD
        identify.window_length TRAINING_LENGTHS
        models.forces.estimator CHUNK_ROWS
        effects.wind_loads BLOCK
        effects.wind KEPT
        models.forces.residual _RUNS
        models.prediction.free_run MAX_STARTS MOST_RUNS
        compare.comparison_statements TOLD_QUANTITIES
        regression.cross_products CHUNK_ROWS SEGMENT_ROWS _BLAS_ENTRIES
        regression.cross_validation.folds MOST_GROUPS
        regression.nipals _BLAS_ENTRIES
        regression.qr _BLOCK_ROWS
        regression.recurrence _MANY
        regression.resampling.bootstrap _BINS _BATCH
        regression.resampling.paired_bootstrap DRAWS
    """,
}
"""Numbers that decide nothing of what is found, by reason: a module and its constants in each line."""

EVERY = [pytest.param(name, one, id=f"{name}.{one.name}") for _, name, stage in stages() for one in fields(type(stage))]


def test_the_page_is_that_of_the_dataclasses() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "Fix: python -m tests.docs.thresholds"


@pytest.mark.parametrize(("name", "one"), EVERY)
def test_a_threshold_has_unit_meaning_and_basis(name: str, one: Field[Any]) -> None:
    assert set(one.metadata) == {"unit", "meaning", "basis"}
    assert all(text.strip() for text in one.metadata.values())
    basis = one.metadata["basis"]
    begin = next((begin for begin in BASES if basis.startswith(begin)), None)
    assert begin is not None, f"{name}.{one.name} is neither of {BASES}"
    assert len(basis) > len(begin) + 2, f"{name}.{one.name} does not say from or for what"


@pytest.mark.slow
def test_every_threshold_is_used() -> None:
    used = {
        (node.value.id, node.attr)
        for path in (ROOT / "ferryid").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name)
    }
    assert [
        f"{name}.{one.name}" for _, name, stage in stages() for one in fields(stage) if (name, one.name) not in used
    ] == []


def is_number(value: object) -> bool:
    """Tell whether a value is a number, or holds nothing but numbers."""
    if isinstance(value, Mapping):
        return bool(value) and all(map(is_number, value.values()))
    if isinstance(value, tuple | list):
        return bool(value) and all(map(is_number, value))
    return isinstance(value, int | float | np.ndarray) and not isinstance(value, bool)


def constants(tree: ast.Module) -> Iterator[str]:
    """Yield the names of constants of a module into which a number is written."""
    for node in tree.body:
        if isinstance(node, ast.Assign):
            targets: list[ast.expr] = node.targets
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            targets = [node.target]
        else:
            continue
        assert node.value is not None
        if any(isinstance(one, ast.Constant) and type(one.value) in (int, float) for one in ast.walk(node.value)):
            names = [one.id for target in targets for one in ast.walk(target) if isinstance(one, ast.Name)]
            yield from (name for name in names if name.isupper())


def modules() -> list[Path]:
    return sorted(path for package in PACKAGES for path in (ROOT / "ferryid" / package).rglob("*.py"))


def written(path: Path) -> set[str]:
    """Return module and name of each numeric constant of a file."""
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    found = list(constants(ast.parse(path.read_text(encoding="utf-8"))))
    module = import_module(name) if found else None
    return {f"{name.removeprefix('ferryid.')} {one}" for one in found if is_number(getattr(module, one))}


@pytest.mark.slow
def test_no_other_number_decides() -> None:
    listed = [line.split() for text in NO_DECISION.values() for line in text.strip().splitlines()]
    allowed = [f"{module} {name}" for module, *names in listed for name in names]
    there = set().union(*map(written, modules()))
    assert len(allowed) == len(set(allowed))
    assert there - set(allowed) == set(), "Fix: a field of the package's thresholds, or NO_DECISION with a reason"
    assert set(allowed) - there == set(), "Fix: take them out of NO_DECISION"


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("LEAST = 0.5", ["LEAST"]),
        ("_LEAST, MOST = -0.5, 10", ["_LEAST", "MOST"]),
        ("LEAST: float = 2 * PERIOD", ["LEAST"]),
        ("LEAST = JUDGING.least", []),
        ("least = 0.5", []),
        ("NAME = 'one'", []),
        ("FLAG = True", []),
    ],
)
def test_constants_are_found(text: str, names: list[str]) -> None:
    assert list(constants(ast.parse(text))) == names
