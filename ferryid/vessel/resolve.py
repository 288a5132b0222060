"""Frames that need another signal: body velocity from world velocity, true wind from apparent, what can be derived."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.types import Floats
from ferryid.vessel.frames import derivative, to_body, to_world
from ferryid.vessel.profile import Profile, Signal

SWAY_NOT_MEASURED = "Sway velocity is not measured: taken as zero; the model is reduced to surge and yaw."
"""What inspect, fit and every command that opens a log say of a velocity that has surge alone."""


def resolve(profile: Profile, columns: Mapping[str, Floats], rate_hz: float | None = None) -> dict[str, Floats]:
    """Complete aligned columns: `u, v, r` and true wind, at the body origin, and the payload's place.

    Where the log has no yaw rate it is the slope of the heading, where it has no velocity that of the position, and beside
    a velocity of surge alone, sway is taken as zero. `resolve_notes` says so. Differences never reach across missing samples.

    Parameters
    ----------
    profile
        Vessel profile.
    columns
        Canonical columns on one uniform grid, shape (n,) each. They are not written to.
    rate_hz
        Rows per second; needed only where something is differentiated.

    Returns
    -------
    dict
        The columns given, with antennas and logs moved to the body origin, plus those resolved. ``vel_N``, ``vel_E``,
        ``wind_speed`` and ``wind_from`` are replaced by what they give.

    Raises
    ------
    FerryIdError
        When something must be differentiated and `rate_hz` is missing, or no velocity can be had.
    """
    out = {name: np.asarray(values, dtype=np.float64) for name, values in columns.items()}
    signals = {signal.quantity: signal for signal in profile.signals}
    if "r" not in out:
        if "psi" not in out:
            raise FerryIdError(
                f"{profile.path}: the yaw rate is needed, found neither yaw rate nor heading in the log. "
                "Fix: map one of them"
            )
        out["r"] = _slope(profile, out["psi"], rate_hz, angle=True)
    _move_position(out, signals.get("position"))
    _body_velocity(profile, out, signals, rate_hz)
    _true_wind(out, signals.get("wind"))
    _payload_place(out, signals.get("payload"))
    return out


def slopes_of_pose(columns: Collection[str]) -> frozenset[str]:
    """Return which of `u, v, r` are slopes of the position or heading that `resolve` takes, given these columns.

    They show what the pose shows, its errors included, and are no second witness of anything.
    """
    turning = {"r"} if "r" not in columns and "psi" in columns else set[str]()
    moving = {"u", "v"} if not {"u", "vel_N"} & set(columns) and "x" in columns else set[str]()
    return frozenset(turning | moving)


def resolve_notes(profile: Profile, columns: Collection[str]) -> tuple[str, ...]:
    """Say in sentences what `resolve` derives from other signals, or must leave out, given these columns."""
    notes, slopes = [], slopes_of_pose(columns)
    if "r" in slopes:
        notes.append("Yaw rate is the slope of the heading: the log has no yaw rate.")
    if "u" in slopes:
        notes.append("Surge and sway are the slope of the position turned by the heading: the log has no velocity.")
    elif "u" not in columns and "vel_N" in columns:
        notes.append("Surge and sway are the velocity over ground turned by the heading.")
    elif "u" in columns and "v" not in columns:
        notes.append(SWAY_NOT_MEASURED)
    payload = next((signal for signal in profile.signals if signal.quantity == "payload"), None)
    if payload is not None and "payload_kg" in columns and "payload_x" not in columns:
        notes.append(f"The payload's place is not measured: the profile puts it at x = {payload.mount_m[0]:g} m.")
    wind = next((signal for signal in profile.signals if signal.quantity == "wind"), None)
    if wind is not None and "wind_speed" in columns:
        if "psi" not in columns:
            notes.append("The wind was left out: without a heading it cannot be turned to north.")
        elif wind.options["air"] == "apparent":
            notes.append("True wind is the apparent wind plus the vessel's own velocity over ground.")
    return tuple(notes)


def _slope(profile: Profile, values: Floats, rate_hz: float | None, *, angle: bool = False) -> Floats:
    if rate_hz is None:
        raise FerryIdError(
            f"{profile.path}: the log has no velocity or yaw rate and the rate of its rows is not known. "
            "Fix: pass rate_hz to resolve"
        )
    return derivative(values, rate_hz, angle=angle)


def _move_position(out: dict[str, Floats], signal: Signal | None) -> None:
    if signal is None or signal.mount_m == (0.0, 0.0) or "x" not in out or "psi" not in out:
        return
    north, east = to_world(
        np.full_like(out["x"], signal.mount_m[0]), np.full_like(out["x"], signal.mount_m[1]), out["psi"]
    )
    out["x"], out["y"] = out["x"] - north, out["y"] - east


def _body_velocity(
    profile: Profile, out: dict[str, Floats], signals: Mapping[str, Signal], rate_hz: float | None
) -> None:
    mount_m = (0.0, 0.0)
    if "u" in out:
        mount_m = signals["velocity"].mount_m if "velocity" in signals else mount_m
    elif "vel_N" in out and "psi" in out:
        out["u"], out["v"] = to_body(out.pop("vel_N"), out.pop("vel_E"), out["psi"])
        mount_m = signals["velocity"].mount_m
    elif "x" in out and "psi" in out:
        north, east = _slope(profile, out["x"], rate_hz), _slope(profile, out["y"], rate_hz)
        out["u"], out["v"] = to_body(north, east, out["psi"])
    else:
        raise FerryIdError(
            f"{profile.path}: surge and sway velocity are needed, found neither body velocity nor world velocity or "
            "position with a heading in the log. Fix: map one of them"
        )
    reduced = "v" not in out
    if reduced:
        out["v"] = np.where(np.isfinite(out["u"]), 0.0, np.nan)
    if mount_m != (0.0, 0.0):
        # v_P = v_O + r × p, so the velocity at the origin is the measured one less the turning of the arm.
        out["u"] = out["u"] + out["r"] * mount_m[1]
        out["v"] = out["v"] if reduced else out["v"] - out["r"] * mount_m[0]


def _true_wind(out: dict[str, Floats], signal: Signal | None) -> None:
    if signal is None or "wind_speed" not in out:
        return
    speed, direction = out.pop("wind_speed"), out.pop("wind_from")
    if "psi" not in out:
        return
    bearing = direction + out["psi"] if signal.options["reference"] == "bow" else direction
    # The direction is where the air comes from; it goes the other way.
    north, east = -speed * np.cos(bearing), -speed * np.sin(bearing)
    if signal.options["air"] == "apparent":
        over_north, over_east = to_world(out["u"], out["v"], out["psi"])
        north, east = north + over_north, east + over_east
    out["wind_N"], out["wind_E"] = north, east


def _payload_place(out: dict[str, Floats], signal: Signal | None) -> None:
    if signal is not None and "payload_kg" in out and "payload_x" not in out:
        out["payload_x"] = np.where(np.isfinite(out["payload_kg"]), signal.mount_m[0], np.nan)
