"""The next trial: which manoeuvres would tell most about a vessel, and the waypoints of a trial made of them."""

from ferryid.planning.plan import Plan, PlanSettings, check_request, plan
from ferryid.planning.result import as_json, as_text, summary
from ferryid.planning.waypoints import check_place, write_plan

__all__ = [
    "Plan",
    "PlanSettings",
    "as_json",
    "as_text",
    "check_place",
    "check_request",
    "plan",
    "summary",
    "write_plan",
]
