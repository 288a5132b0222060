"""The effective mass of a model: over the rigid body's, whether a hull can have it, and between what the truth lies."""

from ferryid.identify.inertia.checks import inertia_checks, light_axes, undetermined, why_too_light

__all__ = ["inertia_checks", "light_axes", "undetermined", "why_too_light"]
