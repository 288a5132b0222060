"""A model as it is exported: the force that its hull takes, what acts beside it, and states to check a copy with."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ferryid.effects import effects
from ferryid.effects.wording import titled
from ferryid.errors import FerryIdError
from ferryid.export.cases import Case, cases, effective_mass, invertible
from ferryid.export.names import identifier, legal
from ferryid.models import RANGE_UNITS, Model, Quantity, StoredEffect
from ferryid.models.forces import Estimator, acting_estimator, scale_hull
from ferryid.types import Floats
from ferryid.vessel.profile import Hull

HULL, THRUSTERS, SENSORS = "hull", "thrusters", "sensors"


@dataclass(frozen=True)
class Acting:
    """A property of the vessel, and what it acts on: what acts on the hull is counted in, the rest is told as numbers."""

    stored: StoredEffect
    on: str

    @property
    def name(self) -> str:
        """Effect and thruster as one name."""
        return legal("_".join(filter(None, (self.stored.effect, self.stored.instance))))

    @property
    def title(self) -> str:
        """Effect and thruster for people."""
        return titled(effects()[self.stored.effect].title, self.stored.instance)

    @property
    def parameters(self) -> dict[str, Quantity]:
        """Parameters by legal names."""
        return {legal(name): one for name, one in self.stored.parameters.items()}


@dataclass(frozen=True)
class Exported:
    """What a form writes down.

    Attributes
    ----------
    model
        The model.
    sha256
        Of the model's file.
    name
        What the code is called: letters, digits and underscores.
    force
        The force that a motion takes, with the hull as the properties of the vessel alter it.
    acting
        The properties of the vessel.
    ranges
        Ranges of validity that are known: name, low, high, unit.
    cases
        States with the force and acceleration that ferryid gives for them.
    """

    model: Model
    sha256: str
    name: str
    force: Estimator
    acting: tuple[Acting, ...]
    ranges: tuple[tuple[str, float, float, str], ...]
    cases: tuple[Case, ...]

    @property
    def hull(self) -> Hull:
        """The hull with the factors delta and sigma in it."""
        return scale_hull(self.force.profile.hull, self.force.scale)

    @property
    def zeta(self) -> float:
        """What divides the force of hull, wind and payload."""
        return float(self.force.scale.get("zeta", 1.0))

    @property
    def mass(self) -> Floats:
        """Force by acceleration, the terms included [kg, kg·m, kg·m²], shape (3, 3)."""
        return effective_mass(self.force)

    @property
    def needs_wind(self) -> bool:
        """True where the terms say nothing without a wind."""
        return self.force.basis is not None and self.force.basis.needs_wind

    @property
    def needs_current(self) -> bool:
        """True where the terms say nothing without a current."""
        return self.force.basis is not None and self.force.basis.needs_current

    def left_out(self) -> tuple[str, ...]:
        """Return what of the model is not exported, as sentences."""
        told = []
        for one in self.model.conditions:
            titles = ", ".join(titled(effects()[e.effect].title, e.instance).lower() for e in one.effects)
            told.append(f"not exported: {titles} of the log {one.log}. Conditions are those of one log.")
        if self.model.conditions and not self.acting:
            what = "hull and what was learned beside it" if self.model.learned else "hull alone"
            told.append(f"the diagnosis found no property of the vessel: what is exported is the {what}.")
        return tuple(told)

    def warnings(self) -> tuple[str, ...]:
        """Return what a user of the file has to know, as sentences."""
        told = []
        if not self.model.accepted:
            told.append(f"{self.model.label} was not accepted: it may be worse than its base model.")
        beside = {on: [one.title.lower() for one in self.acting if one.on == on] for on in (THRUSTERS, SENSORS)}
        if beside[THRUSTERS]:
            told.append(
                f"{', '.join(beside[THRUSTERS])}: named numbers in the file. They act between order and thrust; the "
                "exported force is what the hull takes, and takes no account of them."
            )
        if beside[SENSORS]:
            told.append(
                f"{', '.join(beside[SENSORS])}: named numbers in the file. Correct what is measured before it goes in."
            )
        if not invertible(self.mass):
            told.append("the mass matrix cannot be inverted: force is exported, acceleration is undefined.")
        elif np.linalg.eigvalsh((self.mass + self.mass.T) / 2).min() <= 0.0:
            told.append("the mass matrix is not positive definite: a simulation with it runs away.")
        return tuple(told)


def exported(model: Model, sha256: str, name: str = "") -> Exported:
    """Return a model as it is exported.

    Parameters
    ----------
    model
        The model.
    sha256
        Of its file.
    name
        What the code is called; after name and version of the model where left out.

    Raises
    ------
    FerryIdError
        For a model with effects whose inertia couples surge to sway and yaw, one whose terms are not those of its basis,
        and one that gives no finite force.
    """
    force = acting_estimator(model)
    known = tuple(
        (key, low, high, RANGE_UNITS.get(key, ""))
        for key, (low, high) in model.ranges.items()
        if math.isfinite(low) and math.isfinite(high)
    )
    with np.errstate(all="ignore"):
        checked = cases(force, {key: (low, high) for key, low, high, _ in known})
    if not all(np.isfinite(one.tau).all() for one in checked):
        raise FerryIdError(
            f"{model.label}: gives forces that are not finite, so there is nothing to export. "
            "Fix: fit the model again, or restore its file from a backup"
        )
    acting = tuple(Acting(one, _on(one)) for one in model.vessel_effects)
    return Exported(model, sha256, name or identifier(model.name, model.version), force, acting, known, checked)


def _on(stored: StoredEffect) -> str:
    effect = effects()[stored.effect]
    return SENSORS if effect.of_sensor else HULL if effect.changes_hull else THRUSTERS
