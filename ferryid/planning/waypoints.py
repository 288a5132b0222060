"""A plan as files: poses over time (CSV), a scenario for the simulator (TOML), a mission for QGroundControl, and JSON.

QGroundControl: plan file format 1, https://docs.qgroundcontrol.com/master/en/qgc-dev-guide/file_formats/plan.html; commands of
MAVLink, https://mavlink.io/en/messages/common.html.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import cos, degrees, hypot, isfinite, radians
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.errors import FerryIdError
from ferryid.files import dump_json, taken, write_text
from ferryid.planning.plan import Plan, Track
from ferryid.types import Floats

CSV, SCENARIO, MISSION, JSON, PICTURE = "plan.csv", "plan.toml", "qgroundcontrol.plan", "plan.json", "plan.svg"
FILES = (CSV, SCENARIO, MISSION, JSON, PICTURE)
EARTH_M = 6_371_000.0
NAV_WAYPOINT, DO_CHANGE_SPEED = 16, 178
MISSION_FRAME, GLOBAL_RELATIVE = 2, 3
"""Frames of MAVLink: of a command without a place, and altitude above home."""
ROVER, ARDUPILOT = 11, 3
"""MAV_TYPE of a surface vessel, and MAV_AUTOPILOT, of a mission that any of them reads."""
LEG = 0.02
"""How far a straight leg of a mission may leave the path, in breadths of the area."""


def write_plan(
    plan: Plan,
    folder: Path,
    result: Mapping[str, Any],
    picture: str,
    *,
    origin: tuple[float, float] | None = None,
    bearing_deg: float = 0.0,
    overwrite: bool = False,
) -> dict[str, Any]:
    """Write the files of a plan, and return its result with their paths.

    Parameters
    ----------
    plan
        The plan.
    folder
        Where they go.
    result
        `ferryid.planning.result.as_json`.
    picture
        The picture as SVG.
    origin
        Latitude and longitude of the middle of the area [deg]; without it, and without a path, there is no mission.
    bearing_deg
        Of the area's longer side, clockwise from north; the path is turned by it.
    overwrite
        Replace the files of an earlier plan.

    Raises
    ------
    FerryIdError
        For files that are there and are not to be replaced, a place that is none, and a folder that cannot be written.
    """
    texts = {CSV: as_csv(plan, radians(bearing_deg)), PICTURE: picture, **scenarios(plan)}
    if origin is not None and plan.track is not None:
        texts[MISSION] = json.dumps(mission(plan.track, radians(bearing_deg), origin), indent=1) + "\n"
    check_place(folder, origin, bearing_deg=bearing_deg, overwrite=overwrite)
    for name in FILES:
        (folder / name).unlink(missing_ok=True)
    for old in folder.glob("plan-*.toml"):
        old.unlink()
    told = {
        **result,
        "bearing_deg": bearing_deg,
        "origin_deg": None if origin is None else list(origin),
        "files": [str(folder / name) for name in (*texts, JSON)],
    }
    for name, text in texts.items():
        write_text(folder / name, text)
    write_text(folder / JSON, dump_json(told))
    return told


def _is_plan(file: Path) -> bool:
    """Tell whether a file is the JSON of a plan."""
    try:
        return str(json.loads(file.read_text(encoding="utf-8"))["schema"]).startswith("ferryid.plan/")
    except (OSError, ValueError, KeyError, TypeError):
        return False


def check_place(
    folder: Path, origin: tuple[float, float] | None, *, bearing_deg: float = 0.0, overwrite: bool = False
) -> None:
    """Refuse places that are none, and a folder whose plan is not to be replaced.

    Raises
    ------
    FerryIdError
        For the first fault.
    """
    if origin is not None and not (abs(origin[0]) <= 85.0 and abs(origin[1]) <= 180.0):
        raise FerryIdError(
            f"--origin: latitude is -85 to 85 and longitude -180 to 180 deg, found {origin[0]:g},{origin[1]:g}. "
            "Fix: give the middle of the area as LATITUDE,LONGITUDE"
        )
    if not isfinite(bearing_deg) or abs(bearing_deg) > 360.0:
        raise FerryIdError(f"--bearing: is -360 to 360 deg, found {bearing_deg:g}. Fix: give such an angle")
    there = [folder / name for name in FILES if (folder / name).exists()]
    if there and not overwrite:
        raise taken(there[0])
    if there and not _is_plan(folder / JSON):
        raise FerryIdError(
            f"{there[0]}: cannot be replaced, found no plan beside it. Fix: give another folder with --out"
        )


def turned(poses: Floats, angle: float) -> Floats:
    """Return poses turned clockwise by an angle [rad] about the middle of the area."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * poses[:, 0] - s * poses[:, 1], s * poses[:, 0] + c * poses[:, 1], poses[:, 2] + angle])


def scenarios(plan: Plan) -> dict[str, str]:
    """Return scenarios for the simulator by file: one of a path, its longer side to the north, or one a manoeuvre."""
    if plan.generic_hull:
        return {}  # the simulator would not know the hull
    if plan.track is not None:
        return {SCENARIO: plan.track.scenario.text}
    made = [one.scenario for one in plan.chosen if one.scenario is not None]
    return {f"plan-{k}.toml": one.text for k, one in enumerate(made, 1)}


def as_csv(plan: Plan, bearing: float = 0.0) -> str:
    """Return poses as a row every step, or the orders of manoeuvres as a row each.

    A path has time [s], north, east [m], heading [deg, 0 to 360] and number of the manoeuvre; orders have begin and end [s],
    kind, order to the actuators [rpm or N], helm and, of a zigzag, the change of heading that reverses it [deg].
    """
    if plan.track is None:
        lines = ["begin_s,end_s,kind,order_rpm_or_N,helm_deg,heading_deg"]
        for one in plan.chosen:
            if one.orders is not None and one.scenario is not None:
                asked, order = one.orders, one.scenario.manoeuvre.speed_rpm
                swing = f"{asked.heading_deg:g}" if asked.kind == "zigzag" else ""
                times = f"{one.begin_s:.1f},{one.end_s:.1f}"
                lines.append(f"{times},{asked.kind},{order:.4g},{asked.helm_deg:g},{swing}")
        return "\n".join(lines) + "\n"
    begins = np.array([one.begin_s for one in plan.chosen])
    lines = ["time_s,north_m,east_m,heading_deg,manoeuvre"]
    for k, (north, east, heading) in enumerate(turned(plan.track.poses, bearing).tolist()):
        t = k * plan.track.step_s
        number = int(np.searchsorted(begins, t + 1e-9, side="right"))
        lines.append(f"{t:.2f},{north:.3f},{east:.3f},{degrees(heading) % 360.0:.2f},{number}")
    return "\n".join(lines) + "\n"


def mission(track: Track, bearing: float, origin: tuple[float, float]) -> dict[str, Any]:
    """Return a mission for QGroundControl: straight legs with their speeds, and the heading of each.

    A mission holds no times and no quick turns: swings and turns on the spot become waypoints with headings. The CSV has them.
    """
    items: list[dict[str, Any]] = []
    speed, poses = None, turned(track.poses, bearing)
    for first, end in legs(poses, LEG * track.area[1]):
        way = hypot(*(poses[end, :2] - poses[first, :2]))
        asked = round(float(way / ((end - first) * track.step_s)), 2)
        if asked > 0.0 and asked != speed:
            items.append(_item(len(items), DO_CHANGE_SPEED, [1, asked, -1, 0, 0, 0, 0], MISSION_FRAME))
            speed = asked
        yaw = round(degrees(float(poses[end, 2])) % 360.0, 1)
        items.append(_item(len(items), NAV_WAYPOINT, [0, 0, 0, yaw, *_place(poses[end], origin), 0], GLOBAL_RELATIVE))
    return {
        "fileType": "Plan",
        "geoFence": {"circles": [], "polygons": [], "version": 2},
        "groundStation": "QGroundControl",
        "mission": {
            "cruiseSpeed": round(track.limits.speed[0], 2),
            "firmwareType": ARDUPILOT,
            "hoverSpeed": round(track.limits.speed[0], 2),
            "items": items,
            "plannedHomePosition": [*origin, 0],
            "vehicleType": ROVER,
            "version": 2,
        },
        "rallyPoints": {"points": [], "version": 2},
        "version": 1,
    }


def legs(poses: Floats, tolerance: float) -> list[tuple[int, int]]:
    """Return first and last row of legs that leave the path by no more than a tolerance [m]: Douglas and Peucker (1973).

    A change of heading by more than 45 degrees ends a leg as well.
    """
    points = np.column_stack([poses[:, :2], tolerance * poses[:, 2] / radians(45.0)])
    found, stack = list[tuple[int, int]](), [(0, len(points) - 1)]
    while stack:
        first, end = stack.pop()
        if end - first < 2:
            found.append((first, end))
            continue
        way = points[end] - points[first]
        between = points[first + 1 : end] - points[first]
        along = float(way @ way)
        foot = np.clip(between @ way / along, 0.0, 1.0) if along > 0.0 else np.zeros(len(between))
        off = np.linalg.norm(between - foot[:, None] * way, axis=1)
        worst = int(np.argmax(off))
        if off[worst] <= tolerance:
            found.append((first, end))
        else:
            stack += [(first + 1 + worst, end), (first, first + 1 + worst)]
    return sorted(found)


def _place(pose: Floats, origin: tuple[float, float]) -> list[float]:
    latitude = origin[0] + degrees(float(pose[0]) / EARTH_M)
    longitude = origin[1] + degrees(float(pose[1]) / (EARTH_M * cos(radians(origin[0]))))
    return [round(latitude, 8), round(longitude, 8)]


def _item(number: int, command: int, parameters: list[float], frame: int) -> dict[str, Any]:
    return {
        "autoContinue": True,
        "command": command,
        "doJumpId": number + 1,
        "frame": frame,
        "params": parameters,
        "type": "SimpleItem",
    }
