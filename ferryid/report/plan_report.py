"""A planned trial with its files: what ``ferryid plan`` leaves."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ferryid.errors import FerryIdError
from ferryid.models.store import NAME
from ferryid.planning import PlanSettings, as_json, as_text, check_place, check_request, plan, write_plan
from ferryid.report.outcome import Outcome
from ferryid.report.plan_figures import picture
from ferryid.simulate.control.allocation import pushes_every_way
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile


def plan_and_report(
    profile: Profile,
    logs: Sequence[str],
    settings: PlanSettings,
    run: RunContext,
    *,
    origin: tuple[float, float] | None = None,
    bearing_deg: float = 0.0,
    name: str = "",
    overwrite: bool = False,
) -> Outcome:
    """Plan a trial and write its files to ``plans/<name>`` of the output folder.

    Parameters
    ----------
    profile, logs, settings, run
        As of `ferryid.planning.plan.plan`.
    origin, bearing_deg, overwrite
        As of `ferryid.planning.waypoints.write_plan`.
    name
        Of the plan; the vessel's where empty.
    """
    if run.ranges and not logs:
        raise FerryIdError(
            "--from, --to: select a part of recordings, found no --after. Fix: give --after LOG, or leave them out"
        )
    if name and not NAME.fullmatch(name):
        raise FerryIdError(
            f"--name: {name[:80]!r} cannot name a plan. Fix: use up to 80 letters, digits, points, dashes or underscores"
        )
    # What is wrong whatever the place holds comes first.
    check_request(profile, settings)
    if (origin is not None or bearing_deg) and not pushes_every_way(profile.actuators):
        raise FerryIdError(
            f"--origin, --bearing: {profile.name} steers and gets orders, not a path on a chart. Fix: leave them out"
        )
    folder = Path(run.out) / "plans" / (name or profile.name)
    check_place(folder, origin, bearing_deg=bearing_deg, overwrite=overwrite)
    found = plan(profile, logs, settings, run)
    run.progress("writing the plan")
    told = write_plan(
        found, folder, as_json(found), picture(found), origin=origin, bearing_deg=bearing_deg, overwrite=overwrite
    )
    return Outcome(told, "\n".join([as_text(found), "", *(f"wrote {file}" for file in told["files"])]))
