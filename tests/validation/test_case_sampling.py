"""Case sampling: everything that the contract names, at all sizes, the same for the same seed, in random order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import spearmanr

from ferryid.errors import FerryIdError
from ferryid.validation.case import FORMATS, Case
from ferryid.validation.case_sampling import KINDS, LEVELS, sample_cases
from ferryid.validation.log_generation import generate
from ferryid.validation.plant.effects import complete_conditions, plant_effects
from ferryid.validation.plant.hull import drag, hull_constants
from ferryid.validation.plant.vessels import VESSELS
from ferryid.validation.prior_profile import damping, masses, profile_text, wind_areas
from ferryid.vessel import load_profile

CONTRACT = (
    "wind gusts current waves payload fouling thruster_gain azimuth_offset azimuth_resolution thruster_lag thrust_inflow_loss "
    "thruster_interaction mooring shallow_water time_delay lever_arm heading_bias yaw_rate_scale hull_parameters "
    "dead_band astern_asymmetry thrust_saturation external_push ventilation"
)


@pytest.mark.slow
def test_every_effect_of_the_contract_at_five_sizes() -> None:
    assert sorted(plant_effects()) == sorted(CONTRACT.split())
    every = sample_cases(5, 1.0)
    for name, effect in plant_effects().items():
        some = sorted((case for case in every if case.cell == name), key=lambda case: case.level or 0)
        assert [case.level for case in some] == list(range(LEVELS))
        sizes = [case.size for case in some]
        assert sizes == sorted(sizes)
        assert effect.sizes[0] <= sizes[0]
        assert sizes[-1] <= effect.sizes[1]
        assert all(name in {truth.effect for truth in case.truths} for case in some)
    assert {case.kind for case in every} == set(KINDS)
    assert {case.vessel for case in every} == set(VESSELS)
    assert {case.format for case in every} == set(FORMATS)


def test_the_same_seed_draws_the_same_and_plain_data_brings_it_back() -> None:
    first, again, other = sample_cases(5, 0.4), sample_cases(5, 0.4), sample_cases(6, 0.4)
    assert first == again
    assert [case.seed for case in first] != [case.seed for case in other]
    for case in first:
        assert Case.from_json(case.to_json()).truths == case.truths
        complete_conditions(case.conditions)


def test_the_number_of_a_case_is_random() -> None:
    every = sample_cases(5, 2.0)
    kinds = [KINDS.index(case.kind) for case in every]
    assert abs(spearmanr(range(len(every)), kinds).statistic) < 0.15
    assert [int(case.name) for case in every] == list(range(len(every)))


def test_a_few_runs_are_not_all_of_the_smallest() -> None:
    assert [case.level for case in sorted(sample_cases(5, 0.4, ["wind"]), key=lambda case: case.size)] == [2, 4]


def test_a_few_cells_only() -> None:
    assert {case.cell for case in sample_cases(5, 0.2, ["wind", "short"])} == {"wind"} | {
        case.cell for case in sample_cases(5, 0.2) if case.kind == "short"
    }
    with pytest.raises(FerryIdError, match="no cell 'winds'"):
        sample_cases(5, 1.0, ["winds"])
    for runs in (0.0, -1.0, float("nan"), 1e9):
        with pytest.raises(FerryIdError, match="--runs"):
            sample_cases(5, runs)


@pytest.mark.parametrize("vessel", VESSELS.values(), ids=list(VESSELS))
def test_a_profile_is_what_a_tank_and_a_drawing_give(vessel, tmp_path) -> None:
    path = tmp_path / "vessel.toml"
    path.write_text(profile_text(vessel, {"m11": 0.9, "N_r": 1.1}, vessel.thrusters), encoding="utf-8")
    profile = load_profile(path)
    assert profile.hull.M[0, 0] == pytest.approx(0.9 * (vessel.mass + vessel.added["11"]))
    assert profile.hull.D["N_r"] == pytest.approx(1.1 * damping(vessel)["N_r"])
    assert profile.hull.M[1, 1] == pytest.approx(masses(vessel)["m22"])
    # The fitted form is near the true one on the way ahead, where a tow can be looked up.
    u = 0.7 * vessel.speed_mps
    true = np.zeros(6)
    drag(hull_constants(vessel), np.array([u, 0, 0, 0, 0, 0.0]), 0.0, 1.0, true)
    fitted = damping(vessel)["X_u"] * u + damping(vessel)["X_|u|u"] * u * u
    assert fitted == pytest.approx(true[0], rel=0.05)
    assert 0.5 < wind_areas(vessel).CD_t < 1.3


@pytest.mark.slow
@pytest.mark.xdist_group("validation plant")  # whose first trial compiles: no second worker has to wait for it
@pytest.mark.parametrize("format", FORMATS)
def test_a_case_is_written_the_same_each_time_and_its_transfer_log_is_another(format, tmp_path) -> None:
    from dataclasses import replace

    (case,) = sample_cases(5, 0.1, ["short: thruster_gain"])
    case = replace(case, format=format)
    made = [generate(case, tmp_path / name) for name in ("a", "b")]
    other = generate(case, tmp_path / "c", transfer=True)
    assert {path.name for path in (tmp_path / "a").iterdir()} == {made[0].log.name, "vessel.toml"}
    assert _bytes(made[0].log) == _bytes(made[1].log) != _bytes(other.log)
    assert made[0].profile.read_bytes() == other.profile.read_bytes()
    text = made[0].profile.read_text("utf-8")
    assert "gain" not in text, "a profile has no answer"


def _bytes(log) -> bytes:
    return b"".join(path.read_bytes() for path in sorted(log.iterdir())) if log.is_dir() else log.read_bytes()


def test_a_setting_that_no_effect_has_is_refused() -> None:
    with pytest.raises(ValueError, match="no effect of the plant has the settings wnd"):
        complete_conditions({"wnd": (1.0, 0.0)})
