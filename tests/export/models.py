"""Models of every kind that is exported, and random states with the force that ferryid's own estimator gives for them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ferryid.models.forces.model_forces import acting_estimator
from ferryid.models.model import Model
from ferryid.models.stored_effect import Conditions
from ferryid.regression.bases.basis import make_basis
from ferryid.vessel import load_profile
from tests.models.test_store import made
from tests.models.test_stored_effect import HERE, WINDY, diagnosed, stored

SHA = "5e" * 32
RANGES = {"u": (-0.5, 1.25), "v": (-0.4, 0.4), "r": (-0.2, 0.2), "u_dot": (-0.1, 0.1), "payload_kg": (0.0, 400.0)}
BROKEN = (
    stored("fouling", surge=1.8, sway=1.3, yaw=1.3),
    stored("thruster_gain", "thruster2", factor=0.6),
    stored("azimuth_offset", "thruster1", angle=12.0),
    stored("thruster_lag", time_constant=0.8),
    stored("thrust_inflow_loss", per_mps=0.15),
    stored("dead_band", "thruster1", ahead=120.0),
    stored("astern_asymmetry", "thruster2", factor=0.7),
    stored("thrust_saturation", "thruster1", ahead=220.0),
    # A parameter that is a keyword in Python.
    stored("ventilation", "thruster2", **{"factor": 0.5, "from": 55.0}),
    stored("heading_bias", angle=2.0),
)


def fitted(
    name: str,
    structure: str,
    *,
    vessel: str = "milliampere",
    delta: float = 1.0,
    sigma: float = 1.0,
    zeta: float = 1.0,
    seed: int = 0,
) -> Model:
    """Return a model as a fit leaves it, with coefficients of the size of the vessel's."""
    functions = make_basis(name, structure=structure)
    profile = load_profile(vessel)
    rng = np.random.default_rng(seed)
    theta = 0.05 * profile.hull.mass_kg * rng.normal(size=(len(functions.terms), 3)) * functions.mask
    return replace(
        made(),
        name=vessel,
        version=3,
        profile_text=profile.text,
        scale={"delta": delta, "sigma": sigma, "zeta": zeta},
        settings={"basis": name, "structure": structure, "components": 7, "window_s": 1.0},
        terms=functions.terms,
        units=functions.units,
        theta=theta,
        low=theta - 1.0,
        high=theta + 1.0,
        intercept=0.01 * profile.hull.mass_kg * rng.normal(size=3),
        covariance=np.zeros((3, len(functions.terms) + 1, len(functions.terms) + 1)),
        ranges=RANGES,
    )


def without_terms() -> Model:
    """Return a model as a diagnosis leaves it: a hull, no basis."""
    none = np.zeros((0, 3))
    bare = replace(
        fitted("modulus", "decoupled"),
        settings={"basis": "none", "structure": "decoupled", "components": 0, "window_s": 1.0},
        terms=(),
        units=(),
        theta=none,
        low=none,
        high=none,
        intercept=np.zeros(3),
        covariance=np.zeros((3, 1, 1)),
    )
    return replace(diagnosed(bare, factor=1.05), vessel_effects=())


def broken() -> Model:
    """Return a fitted model with effects on hull, thrusters and sensors."""
    model = diagnosed(fitted("modulus", "decoupled", delta=0.8, sigma=1.3, zeta=0.9))
    return replace(model, vessel_effects=BROKEN)


def windy_alone() -> Model:
    """Return a diagnosed model in which all that was found is a condition of one log."""
    return replace(without_terms(), conditions=(Conditions("trial", HERE, (WINDY,)),))


MODELS = {
    "decoupled": fitted("modulus", "decoupled"),
    "coupled": fitted("modulus", "coupled", seed=1),
    "thesis": fitted("thesis", "decoupled", delta=0.4, sigma=0.4, seed=2),
    "factors": fitted("thesis", "coupled", delta=0.7, sigma=1.6, zeta=1.25, seed=3),
    "thesis flows": fitted("modulus+wind-thesis+current-thesis", "decoupled", seed=4),
    "paper flows": fitted("thesis+wind-paper+current-paper", "coupled", zeta=0.9, seed=5),
    "wind alone": fitted("modulus+wind-paper", "decoupled", delta=1.1, seed=6),
    "current alone": fitted("modulus+current-thesis", "decoupled", seed=7),
    "centre ahead": fitted("modulus+wind-paper", "decoupled", vessel="esso-osaka", delta=0.9, zeta=1.1, seed=8),
    "rigid body": fitted("modulus", "decoupled", vessel="gunnerus", seed=9),
    "cross flow": fitted("cross-flow-5m", "decoupled", zeta=1.1, seed=10),
    "cross flow everywhere": fitted("cross-flow-5m+wind-thesis", "coupled", delta=0.7, seed=11),
    "second order": fitted("second-order", "coupled", seed=12),
    "lift": fitted("lift", "decoupled", seed=13),
    "diagnosed": broken(),
    "no basis": without_terms(),
    "conditions": windy_alone(),
}


@dataclass(frozen=True)
class States:
    """Random states, s rows; a wind, current or payload that is None is given in none of them."""

    nu_dot: np.ndarray
    nu: np.ndarray
    psi: np.ndarray
    wind: np.ndarray | None
    current: np.ndarray | None
    payload: np.ndarray | None

    @property
    def rows(self) -> list[dict[str, list[float] | float | None]]:
        """The states one by one, in plain types."""
        named = {key: None if value is None else value.tolist() for key, value in vars(self).items()}
        return [
            {key: None if value is None else value[i] for key, value in named.items()} for i in range(len(self.psi))
        ]


def states(model: Model, seed: int = 0, count: int = 25) -> list[States]:
    """Return random states with and without every part that the model can do without."""
    rng = np.random.default_rng(seed)
    name = str(model.settings["basis"])
    size = load_profile(model.name if model.name != "boat" else "milliampere").hull
    made = []
    for windy in (False, True):
        for wet in (False, True):
            for loaded in (False, True):
                if (not windy and "wind" in name) or (not wet and "current" in name):
                    continue
                made.append(
                    States(
                        nu_dot=rng.normal(size=(count, 3)) * (0.3, 0.3, 0.1),
                        nu=rng.normal(size=(count, 3)) * (1.5, 0.7, 0.3),
                        psi=rng.uniform(-7.0, 7.0, size=count),
                        wind=6.0 * rng.normal(size=(count, 2)) if windy else None,
                        current=0.5 * rng.normal(size=(count, 2)) if wet else None,
                        payload=rng.uniform((0.0, -1.0), (0.3 * size.mass_kg, 1.0), size=(count, 2))
                        if loaded
                        else None,
                    )
                )
    return made


def force(model: Model, state: States) -> np.ndarray:
    """Return the force that the states take, by ferryid's own estimator with the hull as the vessel's effects alter it."""
    return acting_estimator(model)(state.nu_dot, state.nu, state.psi, state.wind, state.current, state.payload)


def check(found: np.ndarray, wanted: np.ndarray) -> None:
    """Compare to 1e-9 of the largest value of an axis."""
    assert found.shape == wanted.shape
    assert np.isfinite(wanted).all()
    off = np.abs(found - wanted).max(axis=0) / np.abs(wanted).max(axis=0)
    assert (off <= 1e-9).all(), off
