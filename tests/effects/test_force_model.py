"""The force model: its two directions undo each other, and an onset leaves what was before."""

from __future__ import annotations

import sys
from dataclasses import fields, replace

import numpy as np
import pytest

from ferryid.diagnose.inference.candidate import acting_order
from ferryid.diagnose.inference.estimation import Candidate, apply_candidates
from ferryid.effects import effects
from ferryid.effects.effect import Effect
from ferryid.effects.force_model import (
    COEFFICIENTS,
    UNITS,
    ForceModel,
    Measurements,
    aboard,
    acceleration,
    as_measured,
    between,
    hull_changes,
    hull_of,
    required_force,
)
from ferryid.effects.wind import mean_load
from ferryid.vessel import load_profile
from ferryid.vessel.hull import inverse_dynamics
from ferryid.vessel.wind import wind_force
from tests.vessel.hull_matrices import damping

FERRY = load_profile("milliampere")
RNG = np.random.default_rng(4)


@pytest.fixture(autouse=True)
def draws_that_no_other_test_moves(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules[__name__], "RNG", np.random.default_rng(4))


N = 40


def force_model(*, flow: bool, load: bool, damped: bool) -> ForceModel:
    nu = RNG.normal(size=(N, 3)) * [1.0, 0.5, 0.2]
    measurements = Measurements(
        profile=FERRY,
        t=0.2 * np.arange(N),
        eta=RNG.normal(size=(N, 3)) * 3.0,
        nu_raw=nu,
        nu=nu,
        parts=RNG.normal(size=(N, 2, 3)) * 200.0,
        angles=np.zeros((N, 2)),
        usable=np.ones(N, dtype=bool),
    )
    x = RNG.normal(size=N)
    mass = 100.0 + 50.0 * RNG.random(N)
    return ForceModel(
        measurements,
        hull_of(FERRY),
        measurements.parts,
        measurements.angles,
        RNG.normal(size=(N, 3)) * 50.0,
        RNG.normal(size=(N, 2)) * 0.3 if flow else None,
        aboard(np.column_stack([mass, x])) if load else None,
        1.0 + RNG.random(N) if damped else None,
    )


@pytest.mark.parametrize("flow", [False, True])
@pytest.mark.parametrize("load", [False, True])
@pytest.mark.parametrize("damped", [False, True])
def test_the_force_for_an_acceleration_gives_that_acceleration(flow: bool, load: bool, damped: bool) -> None:
    one = force_model(flow=flow, load=load, damped=damped)
    nu_dot = RNG.normal(size=(N, 3))
    needed = required_force(one, nu_dot)
    pushed = replace(one, parts=np.stack([0.3 * needed, 0.7 * needed], axis=1))
    np.testing.assert_allclose(acceleration(pushed), nu_dot, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(required_force(one, acceleration(one)), one.parts.sum(axis=1), rtol=1e-9, atol=1e-9)


def test_the_force_is_that_of_inverse_dynamics() -> None:
    one = replace(force_model(flow=False, load=False, damped=False), external=np.zeros((N, 3)))
    nu_dot = RNG.normal(size=(N, 3))
    np.testing.assert_allclose(
        required_force(one, nu_dot), inverse_dynamics(FERRY.hull, nu_dot, one.measurements.nu), rtol=1e-9
    )


def test_what_begins_later_changes_nothing_before() -> None:
    one = force_model(flow=False, load=False, damped=False)
    after = effects()["payload"].apply(one, np.array([300.0, 0.5]), None)
    late = between(one, after, 4.0)
    rows = one.measurements.t >= 4.0
    assert 0 < rows.sum() < N
    np.testing.assert_array_equal(acceleration(late)[~rows], acceleration(one)[~rows])
    np.testing.assert_array_equal(acceleration(late)[rows], acceleration(after)[rows])


def test_what_ends_changes_nothing_afterwards_and_leaves_the_vessel_as_fast_as_it_is() -> None:
    one = force_model(flow=False, load=False, damped=False)
    payload, p = effects()["payload"], np.array([300.0, 0.5])
    t = one.measurements.t
    for onset_s, offset_s in ((0.0, float(t[20])), (float(t[5]), float(t[20]))):
        seen = acceleration(payload.act(one, p, None, onset_s, offset_s))
        aboard = (t >= onset_s) & (t < offset_s)
        assert aboard.sum() == (20 if onset_s == 0.0 else 15)
        np.testing.assert_array_equal(seen[~aboard], acceleration(one)[~aboard])
        steady = aboard & (t != onset_s) if onset_s > 0.0 else aboard
        np.testing.assert_array_equal(seen[steady], acceleration(payload.apply(one, p, None))[steady])
        assert (seen[5] != acceleration(payload.apply(one, p, None))[5]).any() == (onset_s > 0.0), "the kick"


@pytest.mark.parametrize("name", COEFFICIENTS)
def test_the_unit_of_a_coefficient_follows_from_its_name(name: str) -> None:
    # Every coefficient gives a force [kg m/s²] or, on yaw, a moment [kg m²/s²] from the product that its index names.
    if name.startswith("m"):
        row, column = int(name[1]), int(name[2])
        metres, seconds = (row == 3) + (column == 3), 0
    else:
        index = name.partition("_")[2].replace("|", "")
        metres = (2 if name[0] == "N" else 1) - sum(letter in "uv" for letter in index)
        seconds = -2 + len(index)
    parts = ["kg"]
    over = []
    for unit, power in (("m", metres), ("s", seconds)):
        text = unit + {1: "", 2: "²", 3: "³"}.get(abs(power), "")
        if power:
            (parts if power > 0 else over).append(text)
    told = "·".join(parts) + "".join(f"/{one}" for one in over)
    assert dict(zip(COEFFICIENTS, UNITS, strict=True))[name] == told


LIFTING = {"Y_uv": -300.0, "Y_ur": 200.0, "N_uv": -150.0, "N_ur": -80.0}


def lifting(one: ForceModel, nu: tuple[float, float, float]) -> np.ndarray:
    """Return the force of lift [N, N, N·m] alone at a steady velocity: what a force model with lift needs less."""
    hull = one.hull.copy()
    for name, value in LIFTING.items():
        hull[COEFFICIENTS.index(name)] = value
    moving = replace(one, measurements=replace(one.measurements, nu=np.tile(nu, (N, 1))))
    rest = np.zeros((N, 3))
    return (required_force(moving, rest) - required_force(replace(moving, hull=hull), rest))[0]


def test_lift_by_hand() -> None:
    one = force_model(flow=False, load=False, damped=False)
    assert lifting(one, (2.0, 0.5, 0.0)) == pytest.approx([0.0, -300.0, -150.0])
    assert lifting(one, (2.0, 0.0, 0.1)) == pytest.approx([0.0, 40.0, -16.0])
    assert lifting(one, (0.0, 0.5, 0.1)) == pytest.approx([0.0, 0.0, 0.0])


def test_a_hull_and_its_mirror_image_lift_to_opposite_sides() -> None:
    one = force_model(flow=False, load=False, damped=False)
    to_starboard, to_port = lifting(one, (1.5, 0.4, 0.2)), lifting(one, (1.5, -0.4, -0.2))
    assert to_starboard == pytest.approx(-to_port)
    assert abs(to_starboard[1]) > 100.0


def test_a_hull_lifts_in_the_water_that_it_moves_through() -> None:
    one = force_model(flow=False, load=False, damped=False)
    aground = replace(
        one, measurements=replace(one.measurements, eta=np.zeros((N, 3))), flow=np.tile([-2.0, -0.5], (N, 1))
    )
    assert lifting(aground, (0.0, 0.0, 0.0)) == pytest.approx([0.0, -300.0, -150.0])


def test_lift_is_that_of_the_vessel_layer() -> None:
    lifts = replace(FERRY, hull=replace(FERRY.hull, D={**FERRY.hull.D, **LIFTING}))
    one = replace(force_model(flow=False, load=False, damped=False), hull=hull_of(lifts), external=np.zeros((N, 3)))
    nu_dot, nu = RNG.normal(size=(N, 3)), one.measurements.nu
    np.testing.assert_allclose(required_force(one, nu_dot), inverse_dynamics(lifts.hull, nu_dot, nu), rtol=1e-9)
    taken = damping(lifts.hull.D, nu) - damping(FERRY.hull.D, nu)
    alone = inverse_dynamics(lifts.hull, nu_dot, nu) - inverse_dynamics(FERRY.hull, nu_dot, nu)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", taken, nu), alone, atol=1e-9)


def test_a_load_that_lay_still_takes_its_share_of_the_momentum() -> None:
    before = force_model(flow=False, load=False, damped=False)
    payload, p, row = effects()["payload"], np.array([300.0, 0.8]), 17
    assert payload.impulse is not None
    onset_s = float(before.measurements.t[row])
    after = payload.apply(before, p, None)
    with_impulse = between(before, after, onset_s, impulse=payload.impulse(before, p))
    change = (acceleration(with_impulse) - acceleration(between(before, after, onset_s))) * before.measurements.step_s
    nu = before.measurements.nu[row]
    own = FERRY.hull.M
    load = np.array([[300.0, 0.0, 0.0], [0.0, 300.0, 240.0], [0.0, 240.0, 192.0]])
    # What the vessel had, vessel and load have together; the mass matrix has no surge row in common with the others.
    together = own + load
    np.testing.assert_allclose(together @ (nu + change[row]), own @ nu, atol=1e-9 * np.abs(own @ nu).max())
    assert not np.delete(change, row, axis=0).any()


def test_an_acceleration_ahead_is_one_to_port_on_axes_turned_to_starboard() -> None:
    one = force_model(flow=False, load=False, damped=False)
    ahead = acceleration(one)
    turned = as_measured(replace(one, turned=np.pi / 2.0))
    np.testing.assert_allclose(turned, np.column_stack([ahead[:, 1], -ahead[:, 0], ahead[:, 2]]), atol=1e-12)


def test_an_antenna_ahead_swings_to_starboard_where_the_vessel_begins_to_turn_so() -> None:
    one = force_model(flow=False, load=False, damped=False)
    rates = acceleration(one)
    apart = as_measured(replace(one, antenna=(2.0, 0.0))) - rates
    np.testing.assert_allclose(apart, np.column_stack([np.zeros(N), 2.0 * rates[:, 2], np.zeros(N)]), atol=1e-12)
    apart = as_measured(replace(one, antenna=(0.0, 1.5))) - rates
    np.testing.assert_allclose(apart, np.column_stack([-1.5 * rates[:, 2], np.zeros(N), np.zeros(N)]), atol=1e-12)


def suspect(name: str) -> Candidate:
    return Candidate(effects()[name], None, effects()[name].parameters_of(FERRY))


def test_what_corrects_the_measurements_acts_before_the_wind_whatever_the_order() -> None:
    one = force_model(flow=False, load=False, damped=False)
    plain = replace(one, external=one.measurements.air_load, ambient=lambda measurements: measurements.air_load)
    wind, bias = np.array([-6.0, 3.0]), np.array([20.0])
    names, values = (suspect("wind"), suspect("heading_bias")), (wind, bias)
    forth, back = apply_candidates(plain, names, values), apply_candidates(plain, names[::-1], values[::-1])
    np.testing.assert_array_equal(forth.external, back.external)
    # The same air on a vessel that points where it truly points.
    true = wind_force(
        FERRY.wind, np.broadcast_to(wind, (N, 2)), one.measurements.psi - np.radians(20.0), forth.measurements.nu
    )
    np.testing.assert_allclose(forth.external, true, atol=1e-9 * np.abs(true).max())


@pytest.mark.parametrize("last", [one for one in effects().values() if one.acts_last], ids=lambda one: one.id)
def test_what_acts_last_does_the_same_first(last: Effect) -> None:
    """It works out nothing from what the others change, so that a fit need not work out the others anew."""
    one = force_model(flow=True, load=True, damped=True)
    own = last.parameters_of(FERRY)
    values = np.array([each.neutral + 0.3 * each.size for each in own])
    assert np.abs(as_measured(last.act(one, values, None)) - as_measured(one)).max() > 1e-6
    tried = 0
    for other in effects().values():
        # Masses that are off are grown in shallow water, and by a load, as they are then.
        if other.order != 2 or other.of_coefficients or other.id == last.id:
            continue
        theirs = other.parameters_of(FERRY)
        moved = np.array([each.neutral + 0.3 * each.size for each in theirs])
        instance = other.instances(FERRY)[0]
        after = last.act(other.act(one, moved, instance), values, None)
        before = other.act(last.act(one, values, None), moved, instance)
        np.testing.assert_allclose(as_measured(after), as_measured(before), rtol=1e-9, atol=1e-9, err_msg=other.id)
        tried += 1
    assert tried > 5


@pytest.mark.parametrize("effect", [one for one in effects().values() if one.touched], ids=lambda one: one.id)
def test_what_an_effect_does_depends_on_what_it_touches_alone(effect: Effect) -> None:
    """Where that is as it was, a fit takes what it did from there; all else passes through as it is."""
    one, another = force_model(flow=True, load=True, damped=True), force_model(flow=True, load=True, damped=True)
    touched = effect.touched or frozenset()
    other = replace(
        another,
        hull=1.1 * another.hull,
        parts=0.9 * another.parts,
        angles=another.angles + 0.1,
        air=np.ones(2),
        air_factors=np.full(3, 1.1),
        gust_std=0.7,
        turned=0.1,
        antenna=(0.2, 0.1),
    )
    other = replace(other, **{name: getattr(one, name) for name in touched})
    candidate = Candidate(effect, effect.instances(FERRY)[0], effect.parameters_of(FERRY))
    values = np.array([each.neutral + 0.3 * each.size for each in candidate.parameters])
    for span in ({}, {"onset_s": float(one.measurements.t[5]), "offset_s": float(one.measurements.t[15])}):
        spanned = replace(candidate, **span)
        acted = spanned.act(other, values)
        again = spanned.act_again(other, values, one, spanned.act(one, values))
        for each in fields(acted):
            found = getattr(acted, each.name)
            if each.name not in touched:
                assert found is getattr(other, each.name), each.name
            elif each.name != "measurements":
                np.testing.assert_array_equal(found, getattr(again, each.name), err_msg=each.name)


def test_what_stands_in_the_place_of_an_effect_does_not_say_what_it_touches() -> None:
    gain = effects()["thruster_gain"]
    assert gain.touched == {"measurements", "parts"}
    assert replace(gain, apply=lambda force_model, p, instance: force_model).touched is None


def test_what_acts_last_has_its_turn_last_and_large_ones_at_the_very_end() -> None:
    names = ["shallow_water", "wind", "external_push", "current", "heading_bias"]
    order = acting_order([suspect(name) for name in names])
    assert [names[k] for k in order] == ["heading_bias", "current", "external_push", "wind", "shallow_water"]


def test_gusts_raise_the_mean_load_as_an_average_over_many_does() -> None:
    one = force_model(flow=False, load=False, damped=False)
    air, std = np.array([1.5, -2.5]), 1.2
    found = mean_load(one.measurements, air, std)
    draws, raised = air + std * RNG.normal(size=(20_000, 2)), []
    for row in (0, 7, 23):
        psi, nu = (
            np.repeat(values[row : row + 1], len(draws), axis=0)
            for values in (one.measurements.psi, one.measurements.nu)
        )
        average = wind_force(FERRY.wind, draws, psi, nu).mean(axis=0)
        calm = wind_force(FERRY.wind, air[None], psi[:1], nu[:1])[0]
        scale = np.abs(average[:2]).max()
        np.testing.assert_allclose(found[row, :2], average[:2], atol=0.06 * scale)
        raised.append(np.abs(calm[:2] - average[:2]).max() / scale)
    assert max(raised) > 0.1


@pytest.mark.parametrize("flow", [False, True])
@pytest.mark.parametrize("load", [False, True])
@pytest.mark.parametrize("damped", [False, True])
def test_changes_with_the_hull_are_those_of_a_hull_that_is_moved(flow: bool, load: bool, damped: bool) -> None:
    one = replace(force_model(flow=flow, load=load, damped=damped), turned=0.3, antenna=(1.5, -0.8))
    places = np.array([3, 0, 25, *range(4, 25)])
    # Lift has coefficients that are zero.
    moves = 0.05 * np.where(one.hull[places] != 0.0, one.hull[places], 200.0)
    found = hull_changes(one, places, moves)
    assert found.shape == (N, 3, len(places))
    for q, (place, move) in enumerate(zip(places, moves, strict=True)):
        hull = one.hull.copy()
        hull[place] += move
        moved = as_measured(replace(one, hull=hull)) - as_measured(one)
        scale = np.abs(moved).max()
        assert scale > 0.0
        np.testing.assert_allclose(found[:, :, q], moved, rtol=0.0, atol=1e-9 * scale, err_msg=COEFFICIENTS[place])
    # What moves the hull leaves it as it was.
    np.testing.assert_array_equal(one.hull, hull_of(FERRY))


def test_rows_that_do_not_belong_together_are_refused() -> None:
    one = force_model(flow=False, load=False, damped=False)
    short = replace(one, external=one.external[:-1])
    for refused in (short, replace(one, load=np.ones((N - 1, 5))), replace(one, parts=one.parts[1:])):
        with pytest.raises(ValueError, match="other lengths"):
            acceleration(refused)
    with pytest.raises(ValueError, match="other lengths"):
        required_force(short, np.zeros((N, 3)))


def test_a_deeper_hull_moves_more_water_and_is_damped_more() -> None:
    one = force_model(flow=False, load=False, damped=False)
    mass, x, by_draught = 300.0, 0.5, 1.2
    seen = acceleration(effects()["payload"].apply(one, np.array([mass, x, by_draught]), None))
    hull = FERRY.hull
    more = by_draught * mass / (1025.0 * 0.85 * hull.length_m * hull.beam_m * hull.draught_m)
    rigid = np.array([hull.mass_kg, hull.mass_kg, hull.mass_kg * hull.x_g_m, hull.mass_kg * hull.x_g_m, hull.inertia_z])
    masses = one.hull[:5] + more * (one.hull[:5] - rigid) + [mass, mass, mass * x, mass * x, mass * x * x]
    deeper = replace(one, hull=np.concatenate([masses, (1.0 + more) * one.hull[5:]]))
    np.testing.assert_allclose(seen, acceleration(deeper), rtol=1e-9)
