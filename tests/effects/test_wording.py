"""Directions and lists in words, and the sentences that use them."""

from __future__ import annotations

import pytest

from ferryid.effects import effects
from ferryid.effects.wording import amount, bearing, compass_point, listed, weak_evidence
from ferryid.vessel import load_profile


@pytest.mark.parametrize(
    ("degrees", "word"),
    [
        (0.0, "north"),
        (11.2, "north"),
        (11.3, "north-north-east"),
        (90.0, "east"),
        (148.0, "south-south-east"),
        (225.0, "south-west"),
        (349.0, "north"),
        (-45.0, "north-west"),
        (500.0, "south-east"),
    ],
)
def test_the_nearest_of_sixteen_points(degrees: float, word: str) -> None:
    assert compass_point(degrees) == word


@pytest.mark.parametrize(
    ("value", "said"),
    [(104.4, "104"), (9.96, "10"), (9.94, "9.9"), (1.04, "1.0"), (0.29, "0.29"), (-0.0451, "-0.045"), (0.0, "0.0")],
)
def test_an_amount_has_two_digits_where_it_is_small(value: float, said: str) -> None:
    assert amount(value) == said


@pytest.mark.parametrize(
    ("effect", "values", "said"),
    [
        ("waves", {"peak_frequency": 1.05, "moment_std": 0.29}, "with 0.29 N·m (standard deviation)"),
        ("external_push", {"north": 0.3, "east": 0.0, "moment": 0.04}, "with 0.30 N towards"),
        ("payload", {"mass": 0.45, "x": 0.1}, "carried 0.45 kg more"),
        (
            "mooring",
            {"stiffness_north": 0.045, "stiffness_east": 0.02, "north": 1.0, "east": 2.0},
            "of 0.045 N/m (north) and 0.020 N/m (east)",
        ),
    ],
)
def test_what_is_small_on_a_small_boat_is_not_nothing(effect: str, values: dict[str, float], said: str) -> None:
    assert said in effects()[effect].says(values, None)


def test_a_lag_of_orders_is_none_of_measured_speeds() -> None:
    said = effects()["thruster_lag"].says({"time_constant": 2.37}, None)
    assert said == "Thrust follows the recorded speeds, or orders where there is no feedback, with a lag of 2.37 s."


@pytest.mark.parametrize(("loss", "said"), [(0.13, "falls by 13 % per m/s"), (-0.2, "rises by 20 % per m/s")])
def test_a_loss_by_inflow_below_zero_is_a_rise(loss: float, said: str) -> None:
    assert said in effects()["thrust_inflow_loss"].says({"per_mps": loss}, None)


def test_a_bearing_stays_below_a_full_circle() -> None:
    assert bearing(359.7) == "0 deg (north)"
    assert bearing(-0.4) == "0 deg (north)"


def test_a_wind_is_told_by_where_it_blows_from_and_a_current_by_where_it_sets() -> None:
    # The air goes to the north-west, so that the wind is a south-easterly one.
    towards = {"north": 3.0, "east": -3.0}
    assert effects()["wind"].says(towards, None) == (
        "A steady wind of 4.2 m/s from 135 deg (south-east) blew towards 315 deg (north-west)."
    )
    assert effects()["current"].says(towards, None) == "A current of 4.24 m/s set towards 315 deg (north-west)."


@pytest.mark.parametrize("name", sorted(effects()))
def test_a_sentence_is_true_of_a_model_that_has_the_effect(name: str) -> None:
    """The same sentence stands in the letter, in ``models``, ``compare`` and ``evaluate``."""
    effect = effects()[name]
    profile = load_profile("milliampere")
    values = {one.name: one.neutral + one.size for one in effect.parameters_of(profile)}
    says = effect.says(values, effect.instances(profile)[-1])
    assert "left out" not in says
    assert "than the model" not in says


def test_lists_read_like_prose() -> None:
    assert [listed(list(parts)) for parts in ("", "a", "ab", "abc")] == ["", "a", "a and b", "a, b and c"]
    assert listed(["a", "b"], "or") == "a or b"


@pytest.mark.parametrize(
    ("evidence", "told"),
    [
        (-3.0, "the logs are explained as well without it"),
        (0.0, "the logs are explained as well without it"),
        (3.14, "the logs hardly show it: log evidence 3.1 nat over none, 8 are needed"),
    ],
)
def test_weak_evidence_is_told_with_what_is_needed(evidence: float, told: str) -> None:
    assert weak_evidence(evidence, 8.0) == told


@pytest.mark.parametrize(
    ("factors", "told"),
    [
        ((1.78, 1.33, 1.0), "(surge +78 %, sway +33 %, yaw +0 %): the hull is fouled."),
        ((0.7, 0.9, 0.8), "(surge -30 %, sway -10 %, yaw -20 %): the hull is cleaner than the hull model."),
        ((1.5, 0.9, 1.2), "(surge +50 %, sway -10 %, yaw +20 %): the hull is fouled, or cleaner than the hull model."),
    ],
)
def test_fouling_is_told_by_the_sign_of_what_changed(factors: tuple[float, float, float], told: str) -> None:
    values = dict(zip(("surge", "sway", "yaw"), factors, strict=True))
    assert effects()["fouling"].says(values, None) == f"Damping at speed has changed {told}"
