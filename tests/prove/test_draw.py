"""What a proof draws: everything that the contract names, at all sizes, the same for the same seed, and telling nothing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import spearmanr

from ferryid.errors import FerryIdError
from ferryid.prove.case import FORMATS, case_of
from ferryid.prove.conceal import HIDINGS
from ferryid.prove.draw import KINDS, LEVELS, drawn
from ferryid.prove.generate import conditions_of, generate
from ferryid.prove.known import damping, masses, profile_text, wind_areas
from ferryid.prove.plant.hull import drag, hull_constants
from ferryid.prove.plant.vessels import VESSELS
from ferryid.vessel import load_profile

CONTRACT = (
    "wind gusts current waves payload fouling thruster_gain azimuth_offset azimuth_resolution thruster_lag thrust_inflow_loss "
    "thruster_interaction mooring shallow_water time_delay lever_arm heading_bias yaw_rate_scale hull_parameters"
)


def test_every_effect_of_the_contract_at_five_sizes() -> None:
    assert sorted(HIDINGS) == sorted(CONTRACT.split())
    every = drawn(5, 1.0)
    for name, hiding in HIDINGS.items():
        some = sorted((case for case in every if case.cell == name), key=lambda case: case.level or 0)
        assert [case.level for case in some] == list(range(LEVELS))
        sizes = [case.size for case in some]
        assert sizes == sorted(sizes)
        assert hiding.least <= sizes[0]
        assert sizes[-1] <= hiding.most
        assert all(name in {truth.effect for truth in case.truths} for case in some)
    assert {case.kind for case in every} == set(KINDS)
    assert {case.vessel for case in every} == set(VESSELS)
    assert {case.format for case in every} == set(FORMATS)


def test_the_same_seed_draws_the_same_and_plain_data_brings_it_back() -> None:
    first, again, other = drawn(5, 0.4), drawn(5, 0.4), drawn(6, 0.4)
    assert first == again
    assert [case.seed for case in first] != [case.seed for case in other]
    for case in first:
        assert conditions_of(case_of(case.as_json())) == conditions_of(case)
        assert case_of(case.as_json()).truths == case.truths


def test_a_number_tells_nothing() -> None:
    every = drawn(5, 2.0)
    kinds = [KINDS.index(case.kind) for case in every]
    assert abs(spearmanr(range(len(every)), kinds).statistic) < 0.15
    assert [int(case.name) for case in every] == list(range(len(every)))


def test_a_few_runs_are_not_all_of_the_smallest() -> None:
    assert [case.level for case in sorted(drawn(5, 0.4, ["wind"]), key=lambda case: case.size)] == [2, 4]


def test_a_few_cells_only() -> None:
    assert {case.cell for case in drawn(5, 0.2, ["wind", "short"])} == {"wind"} | {
        case.cell for case in drawn(5, 0.2) if case.kind == "short"
    }
    with pytest.raises(FerryIdError, match="no cell 'winds'"):
        drawn(5, 1.0, ["winds"])
    for runs in (0.0, -1.0, float("nan"), 1e9):
        with pytest.raises(FerryIdError, match="--runs"):
            drawn(5, runs)


@pytest.mark.parametrize("vessel", VESSELS.values(), ids=list(VESSELS))
def test_a_profile_is_what_a_tank_and_a_drawing_give(vessel, tmp_path) -> None:
    path = tmp_path / "vessel.toml"
    path.write_text(profile_text(vessel, {"m11": 0.9, "N_r": 1.1}), encoding="utf-8")
    profile = load_profile(path)
    assert profile.hull.M[0, 0] == pytest.approx(0.9 * (vessel.mass + vessel.added["11"]))
    assert profile.hull.D["N_r"] == pytest.approx(1.1 * damping(vessel)["N_r"])
    assert profile.hull.M[1, 1] == pytest.approx(masses(vessel)["m22"])
    # The fitted form is near the true one on the way ahead, where a tow can be looked up.
    u = 0.7 * vessel.speed_mps
    true = np.zeros(6)
    drag(hull_constants(vessel), np.array([u, 0, 0, 0, 0, 0.0]), 0.0, np.ones(3), 1.0, true)
    told = damping(vessel)["X_u"] * u + damping(vessel)["X_|u|u"] * u * u
    assert told == pytest.approx(true[0], rel=0.05)
    assert 0.5 < wind_areas(vessel).CD_t < 1.3


@pytest.mark.parametrize("format", FORMATS)
def test_a_case_is_written_the_same_each_time_and_another_the_second_time(format, tmp_path) -> None:
    from dataclasses import replace

    (case,) = drawn(5, 0.1, ["short: thruster_gain"])
    case = replace(case, format=format)
    made = [generate(case, tmp_path / name) for name in ("a", "b")]
    second = generate(case, tmp_path / "c", again=True)
    assert {path.name for path in (tmp_path / "a").iterdir()} == {made[0].log.name, "vessel.toml"}
    assert _bytes(made[0].log) == _bytes(made[1].log) != _bytes(second.log)
    assert made[0].profile.read_bytes() == second.profile.read_bytes()
    text = made[0].profile.read_text("utf-8")
    assert "gain" not in text, "a profile tells nothing"


def _bytes(log) -> bytes:
    return b"".join(path.read_bytes() for path in sorted(log.iterdir())) if log.is_dir() else log.read_bytes()
