"""The vessel: its profile, hull, thrusters and wind areas, and where its signals live in a log."""

from ferryid.vessel.choice import VesselChoice, choose_vessel, stated_choice
from ferryid.vessel.describe import describe
from ferryid.vessel.faults import Fault
from ferryid.vessel.load import bundled, check_profile, given_as, known, load_profile, parse_profile
from ferryid.vessel.order_response import follow_orders
from ferryid.vessel.resolve import SWAY_NOT_MEASURED, resolve, resolve_notes, slopes_of_pose
from ferryid.vessel.signal_map import Selection, convert, select, survey
from ferryid.vessel.thrusters import actuator_columns, applied_force, speed_doubts

__all__ = [
    "SWAY_NOT_MEASURED",
    "Fault",
    "Selection",
    "VesselChoice",
    "actuator_columns",
    "applied_force",
    "bundled",
    "check_profile",
    "choose_vessel",
    "convert",
    "describe",
    "follow_orders",
    "given_as",
    "known",
    "load_profile",
    "parse_profile",
    "resolve",
    "resolve_notes",
    "select",
    "slopes_of_pose",
    "speed_doubts",
    "stated_choice",
    "survey",
]
