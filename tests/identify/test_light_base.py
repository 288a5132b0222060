"""A profile whose hull model has less inertia than its rigid body says so in a fit."""

from __future__ import annotations

from dataclasses import replace

from ferryid.identify.physical_checks import light_base
from ferryid.vessel import load_profile


def test_a_hull_model_with_less_inertia_than_its_rigid_body_is_a_warning() -> None:
    ferry = load_profile("milliampere")
    assert light_base(ferry) == ()
    (warning,) = light_base(replace(ferry, hull=replace(ferry.hull, M=0.4 * ferry.hull.M)))
    assert warning.startswith(
        "The inertia of the profile's hull model is less than its rigid body's (0.57 in surge, 0.61 in sway and 0.44 in yaw)"
    )
    # Where there is no hull model the base model is the rigid body itself.
    assert light_base(load_profile("esso-osaka")) == ()
