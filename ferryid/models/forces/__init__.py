"""Forces of models: the base model, the lack-of-fit residual, and the force that a model estimates from motion."""

from ferryid.models.forces.estimator import (
    ACCELERATIONS,
    Estimator,
    effective_mass,
    hull_coefficients,
    model_estimator,
    replace_hull_coefficients,
    without_sway_coupling,
)
from ferryid.models.forces.hull_terms import (
    MAPPED,
    UnmappedTerms,
    beside_the_hull,
    hull_contribution,
    hull_covariance,
    unmapped_terms,
)
from ferryid.models.forces.model_forces import ModelForces, acting_estimator, force_law
from ferryid.models.forces.residual import FORMS, base_force, compute_residual, motion_force, scale_hull, without_inputs

__all__ = [
    "ACCELERATIONS",
    "FORMS",
    "MAPPED",
    "Estimator",
    "ModelForces",
    "UnmappedTerms",
    "acting_estimator",
    "base_force",
    "beside_the_hull",
    "compute_residual",
    "effective_mass",
    "force_law",
    "hull_coefficients",
    "hull_contribution",
    "hull_covariance",
    "model_estimator",
    "motion_force",
    "replace_hull_coefficients",
    "scale_hull",
    "unmapped_terms",
    "without_inputs",
    "without_sway_coupling",
]
