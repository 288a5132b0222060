"""What to record so that an effect shows, and so that two explanations come apart."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from ferryid.effects import effects
from ferryid.vessel.circumstances import ANYWHERE, Circumstances, Drive

CALM = "the same manoeuvres in calm air"
"""What shows a delay or a lag that a controller's answer to gusts looks like."""
HULL_FIRST = "a log in calm air and still water, to fit a hull model first"
TURN = "a slow turn on the spot through all headings, then straight runs at several speeds both ways"
STEPS = "steps of the thrusters' speed and angle from rest"
SINGLE = "each thruster alone, at several speeds and angles, ahead and astern"
COAST = "coasting to a stop from full speed with the thrusters off, ahead and sideways"
ELSEWHERE = "the same manoeuvres in deep water, or over the whole of the place and far from it"
STRAIGHT = "long straight runs at constant speed on opposite courses"
STAIRCASE = "each thruster alone in small steps of its order from full ahead through zero to full astern, each held"
BOTH_WAYS = "each thruster alone at the same orders ahead and astern, at rest"
FULL = "each thruster alone in steps from half to full force, at rest"
QUIET = "the same manoeuvres again, with nobody and nothing touching the hull, and a note of the times at which it is touched"
LOADED = "each thruster alone in steps from half to full force and back, at rest, light and deep, in still water"
ACCELERATE = "hard acceleration and turning at low speed, and long straight runs at constant speed"

PAIRS: tuple[tuple[frozenset[str], str], ...] = (
    (frozenset({"wind", "current"}), TURN),
    (frozenset({"wind", "mooring"}), "station keeping at places far apart, at the same headings"),
    (frozenset({"current", "mooring"}), "station keeping at places far apart, at the same headings"),
    (frozenset({"thruster_lag", "time_delay"}), STEPS),
    (frozenset({"payload", "thruster_gain"}), ACCELERATE),
    (frozenset({"payload", "fouling"}), ACCELERATE),
    (frozenset({"fouling", "thrust_inflow_loss"}), "coasting to a stop from full speed with the thrusters off"),
    (frozenset({"shallow_water", "fouling"}), ELSEWHERE),
    (frozenset({"shallow_water", "hull_parameters"}), ELSEWHERE),
    (frozenset({"shallow_water", "mooring"}), "drifting through the place with the thrusters off, from all sides"),
    (frozenset({"shallow_water", "current"}), "runs through the place both ways at several speeds"),
    (frozenset({"shallow_water", "wind"}), "runs through the place both ways at several speeds"),
    (frozenset({"shallow_water", "thruster_gain"}), COAST),
    (frozenset({"shallow_water", "thrust_inflow_loss"}), COAST),
    (frozenset({"shallow_water", "payload"}), ACCELERATE),
    (
        frozenset({"hull_parameters", "fouling"}),
        "straight runs at many speeds from slow to full, ahead and sideways, and turns at many rates",
    ),
    (
        frozenset({"hull_parameters", "payload"}),
        "the same manoeuvres with the vessel empty, or with a weighed mass aboard",
    ),
    (frozenset({"hull_parameters", "thruster_gain"}), "pulling at a quay with a load cell, each thruster alone"),
    (frozenset({"hull_parameters", "thrust_inflow_loss"}), COAST),
    (frozenset({"hull_parameters", "thruster_interaction"}), SINGLE),
    (frozenset({"hull_parameters", "thruster_lag"}), STEPS),
    (frozenset({"hull_parameters", "time_delay"}), STEPS),
    (frozenset({"hull_parameters", "lever_arm"}), "turns on the spot at many rates, without way on"),
    (frozenset({"hull_parameters", "current"}), TURN),
    (frozenset({"fouling", "thruster_gain"}), COAST),
    (frozenset({"fouling", "current"}), STRAIGHT),
    (frozenset({"payload", "thruster_lag"}), STEPS),
    (frozenset({"payload", "lever_arm"}), "turns on the spot at many rates, without way on"),
    (
        frozenset({"thrust_inflow_loss", "thruster_gain"}),
        "steps of each thruster's speed from rest, and again at full speed ahead",
    ),
    (frozenset({"thrust_inflow_loss", "current"}), STRAIGHT),
    (frozenset({"thrust_inflow_loss", "thruster_interaction"}), SINGLE),
    (frozenset({"azimuth_offset", "heading_bias"}), SINGLE),
    (frozenset({"azimuth_offset", "wind"}), TURN),
    (frozenset({"azimuth_offset", "current"}), TURN),
    (frozenset({"heading_bias", "current"}), STRAIGHT),
    (frozenset({"heading_bias", "wind"}), TURN),
    (frozenset({"heading_bias", "lever_arm"}), STRAIGHT),
    (frozenset({"gusts", "waves"}), "the same manoeuvres in shelter, with a wind sensor aboard"),
    (frozenset({"gusts", "time_delay"}), CALM),
    (frozenset({"gusts", "thruster_lag"}), CALM),
    (frozenset({"waves", "time_delay"}), "the same manoeuvres in still water"),
    (frozenset({"waves", "thruster_lag"}), "the same manoeuvres in still water"),
    (frozenset({"thruster_gain", "azimuth_offset"}), SINGLE),
    (frozenset({"thruster_gain", "thruster_interaction"}), SINGLE),
    (frozenset({"dead_band", "thruster_gain"}), STAIRCASE),
    (frozenset({"dead_band", "thrust_saturation"}), STAIRCASE),
    (frozenset({"dead_band", "astern_asymmetry"}), STAIRCASE),
    (frozenset({"dead_band", "thruster_lag"}), STAIRCASE),
    (
        frozenset({"dead_band", "thrust_inflow_loss"}),
        "small steps of each thruster's order at rest, and again with way on",
    ),
    (frozenset({"dead_band", "thruster_interaction"}), STAIRCASE),
    (frozenset({"dead_band", "hull_parameters"}), STAIRCASE),
    (frozenset({"dead_band", "fouling"}), COAST),
    (frozenset({"dead_band"}), STAIRCASE),
    (frozenset({"astern_asymmetry", "thruster_gain"}), BOTH_WAYS),
    (frozenset({"astern_asymmetry", "thrust_saturation"}), FULL + ", ahead and astern"),
    (frozenset({"astern_asymmetry", "thrust_inflow_loss"}), BOTH_WAYS + ", and with way on"),
    (frozenset({"astern_asymmetry", "thruster_interaction"}), BOTH_WAYS),
    (frozenset({"astern_asymmetry", "hull_parameters"}), BOTH_WAYS),
    (frozenset({"astern_asymmetry", "fouling"}), COAST),
    (frozenset({"astern_asymmetry", "current"}), STRAIGHT),
    (frozenset({"astern_asymmetry", "wind"}), TURN),
    (frozenset({"astern_asymmetry"}), BOTH_WAYS),
    (frozenset({"thrust_saturation", "thruster_gain"}), FULL),
    (frozenset({"thrust_saturation", "thrust_inflow_loss"}), FULL + ", and again at speed"),
    (frozenset({"thrust_saturation", "thruster_interaction"}), FULL),
    (frozenset({"thrust_saturation", "thruster_lag"}), STEPS),
    (frozenset({"thrust_saturation", "hull_parameters"}), COAST),
    (frozenset({"thrust_saturation", "fouling"}), COAST),
    (frozenset({"thrust_saturation", "payload"}), FULL + ", and hard accelerations at half force"),
    (frozenset({"thrust_saturation"}), FULL),
    (frozenset({"thruster_gain"}), SINGLE),
    (frozenset({"azimuth_offset"}), SINGLE),
    (frozenset({"external_push", "gusts"}), f"a wind sensor aboard, or {QUIET}"),
    (frozenset({"external_push", "wind"}), f"a wind sensor aboard, or {QUIET}"),
    (frozenset({"external_push", "mooring"}), f"station keeping at places far apart while it acts, or {QUIET}"),
    (frozenset({"external_push", "current"}), QUIET),
    (frozenset({"external_push", "payload"}), f"hard accelerations while it is aboard, or {QUIET}"),
    (frozenset({"external_push", "thruster_gain"}), f"drifting with the thrusters off while it acts, or {QUIET}"),
    (frozenset({"external_push", "waves"}), QUIET),
    (frozenset({"ventilation", "thruster_gain"}), LOADED),
    (frozenset({"ventilation", "thrust_inflow_loss"}), f"{LOADED}, and half force at full speed"),
    (frozenset({"ventilation", "thrust_saturation"}), LOADED),
    (frozenset({"ventilation", "astern_asymmetry"}), f"{LOADED}, ahead and astern"),
    (frozenset({"ventilation", "thruster_interaction"}), LOADED),
    (frozenset({"ventilation", "thruster_lag"}), LOADED),
    (frozenset({"ventilation", "hull_parameters"}), COAST),
    (frozenset({"ventilation", "fouling"}), COAST),
    (frozenset({"ventilation", "payload"}), f"{LOADED}, and hard accelerations at half force"),
    (frozenset({"ventilation"}), LOADED),
)

TURNING = "a slow turn on the spot through all headings"
SPEEDS = "straight runs at several constant speeds up to full speed, both ways, and turns at speed"
SHOWS = {
    "wind": TURNING,
    "current": f"{TURNING}, and straight runs both ways",
    "waves": "station keeping in that sea, at several headings",
    "gusts": TURNING,
    "payload": "hard accelerations and turns from rest",
    "fouling": SPEEDS,
    "thruster_gain": SINGLE,
    "azimuth_offset": SINGLE,
    "dead_band": STAIRCASE,
    "astern_asymmetry": BOTH_WAYS,
    "thrust_saturation": FULL,
    "ventilation": LOADED,
    "external_push": QUIET,
    "azimuth_resolution": SINGLE,
    "thruster_lag": STEPS,
    "time_delay": STEPS,
    "thrust_inflow_loss": "the same thrust at rest and at several speeds",
    "thruster_interaction": "thrust with each thruster's wake on the other one, and beside it",
    "mooring": "station keeping at places far apart",
    "shallow_water": "the same runs in deep and in shallow water",
    "lever_arm": "turns on the spot both ways, at several rates",
    "heading_bias": "straight runs ahead and astern at several headings",
}
"""What a log has to hold to show an effect by itself."""
SENSORS = {
    "wind": "an anemometer",
    "gusts": "an anemometer",
    "current": "a log of the velocity through the water",
    "payload": "a weighed load or draught marks",
    "thruster_gain": "feedback of each thruster's speed or torque",
    "azimuth_offset": "feedback of each thruster's angle",
    "azimuth_resolution": "feedback of each thruster's angle",
    "thruster_lag": "feedback of each thruster's speed",
    "time_delay": "time stamps of one clock for navigation and thrusters",
    "mooring": "a load cell in the line",
    "ventilation": "feedback of each thruster's torque",
    "external_push": "a camera or a note of when the hull is touched",
    "shallow_water": "an echo sounder",
    "lever_arm": "a surveyed place of the antenna",
    "heading_bias": "a second antenna or a compass that was swung",
    "yaw_rate_scale": "a second gyro",
}
"""What measures an effect itself, or what it depends on."""
EXCITES = {
    "surge": "accelerations from rest to full speed and back, ahead and astern",
    "sway": "moves sideways to both sides, from rest and back to rest",
    "yaw": "turns on the spot both ways, at several rates",
}
"""What moves a vessel in each axis."""
OTHERWISE = "a calibration run that excites every axis at many headings"


FITTING: dict[str, tuple[tuple[str, str], ...]] = {
    "tank": (
        (CALM, "the same manoeuvres with the water at rest"),
        (HULL_FIRST, "further logs with the water at rest, to fit a hull model first"),
        ("the same manoeuvres in still water", "the same manoeuvres with the water at rest"),
        ("station keeping in that sea", "station keeping in these waves"),
        ("long straight runs", "straight runs over the length of the tank"),
        ("pulling at a quay with a load cell", "pulling at a load cell on the side of the tank"),
        ("coasting to a stop from full speed", "coasting to a stop from the full speed that the length allows"),
        (ELSEWHERE, "the same manoeuvres at another depth of the water"),
        ("the same runs in deep and in shallow water", "the same runs at two depths of the water"),
    ),
    "pond": (
        ("station keeping in that sea", "station keeping in these waves"),
        ("long straight runs", "straight runs over the length of the pond"),
        ("pulling at a quay with a load cell", "pulling at a load cell on the bank"),
    ),
    "harbour": (("station keeping in that sea", "station keeping in these waves"),),
    "sea": (
        (CALM, "the same manoeuvres in shelter or on a calm day"),
        (HULL_FIRST, "a log in shelter or on a calm day at slack water, to fit a hull model first"),
        ("the same manoeuvres in still water", "the same manoeuvres in shelter or on a calm day"),
    ),
}
"""By setting, what advice for anywhere becomes there: what the place does not have is not asked for."""


def phrases_of(drive: Drive) -> Iterator[tuple[str, str]]:
    """Yield what advice for several thrusters that turn and push every way becomes for a drive, in the order of replacement."""
    if drive.rudder and drive.single:
        yield SINGLE, "several speeds of the propeller, ahead and astern, each at several rudder angles"
        yield "speed and angle from rest", "speed from rest, and of the rudder's angle with way on"
    elif drive.rudder:
        yield "at several speeds and angles", "at several speeds and rudder angles"
        yield "speed and angle from rest", "speed from rest, and of the rudders' angle with way on"
    elif not drive.turned:
        yield "speeds and angles", "speeds"
        yield "speed and angle", "speed"
    if drive.single:
        only = "propeller" if drive.rudder or not drive.turned else "thruster"
        yield ", each thruster alone", ""
        yield "each thruster alone, at", f"the {only} at"
        yield "each thruster alone", f"the {only}"
        yield "each thruster's angle", "the rudder's angle" if drive.rudder else f"the {only}'s angle"
        yield "each thruster's", f"the {only}'s"
        yield "the thrusters'", f"the {only}'s"
        yield "the thrusters off", f"the {only} stopped"
        yield "navigation and thrusters", f"navigation and {only}"
    if not drive.sideways:
        yield ", ahead and sideways", ""
        yield "moves sideways to both sides, from rest and back to rest", "hard turns to both sides at several speeds"
        yield "station keeping", "slow runs"
        yield "at the same headings", "on the same headings"
    if not drive.on_the_spot:
        yield "a slow turn on the spot", "a slow turn"
        yield "turns on the spot at many rates, without way on", "turns at many rates, at low and at high speed"
        yield "turns on the spot both ways, at several rates", "turns both ways, at several rates"


def fitting(advice: str, where: Circumstances) -> str:
    """Return advice as it fits a setting and a drive; as it stands where neither is known.

    What the place does not have, or the vessel cannot do, is not asked for.
    """
    for general, there in (*FITTING.get(where.setting, ()), *phrases_of(where.drive)):
        advice = advice.replace(general, there)
    return advice


def shown_by(effect: str, where: Circumstances = ANYWHERE) -> str:
    """Return what a log from some place and vessel has to hold to show an effect by itself."""
    return fitting(SHOWS.get(effect, OTHERWISE), where)


def excited_by(axis: str, where: Circumstances = ANYWHERE) -> str:
    """Return what moves a vessel in an axis."""
    return fitting(EXCITES[axis], where)


def sensor_of(effect: str, where: Circumstances = ANYWHERE) -> str:
    """Return what measures an effect; empty where nothing does, or the setting does not have it."""
    known = effects().get(effect)
    if known is not None and where.setting in known.absent_in:
        return ""
    return fitting(SENSORS.get(effect, ""), where)


def manoeuvre(effect: str, rivals: Collection[str], where: Circumstances = ANYWHERE) -> str | None:
    """Return what to record to tell an effect from its rivals; None where there is nothing to tell apart.

    A pair without a manoeuvre of its own is told apart by what shows the one and what shows the other.
    """
    if not rivals:
        return None
    known = dict(PAIRS)
    manoeuvres: list[str] = []
    for rival in rivals:
        pair = frozenset({effect, rival})
        manoeuvres += [known[pair]] if pair in known else [SHOWS.get(one, OTHERWISE) for one in (effect, rival)]
    return "; ".join(dict.fromkeys(fitting(one, where) for one in manoeuvres))
