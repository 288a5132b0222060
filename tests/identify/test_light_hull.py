"""A profile whose hull model has less inertia than its rigid body says so in a fit."""

from __future__ import annotations

from dataclasses import replace

from ferryid.identify.inertia import why_too_light
from ferryid.vessel import load_profile


def test_a_hull_model_with_less_inertia_than_its_rigid_body_is_said() -> None:
    ferry = load_profile("milliampere")
    assert why_too_light(ferry) == ""
    warning = why_too_light(replace(ferry, hull=replace(ferry.hull, M=0.4 * ferry.hull.M)))
    assert warning.startswith(
        "The inertia of the profile's hull model is less than its rigid body's (0.57 in surge, 0.61 in sway and 0.44 in yaw)"
    )
    # Where there is no hull model the base model is the rigid body itself.
    assert why_too_light(load_profile("esso-osaka")) == ""
