"""What chooses a signal among others of its topic, and pulses: ``where``, ``element``, ``pulse_us``."""

from __future__ import annotations

from ferryid.vessel.faults import TableReader
from ferryid.vessel.profile import Element
from ferryid.vessel.pulses import PULSE_LIMITS_US


def parse_where(table: TableReader) -> tuple[tuple[str, float], ...]:
    """Take the fields and values of the messages that hold a signal, on a topic that carries several."""
    chosen = table.table("where")
    if chosen is None:
        return ()
    if not chosen.data:
        table.fault('"where" names no field. Fix: where = { MsgID = 5 }, or leave it out', "where")
    found = tuple((path, chosen.number(path)) for path in sorted(chosen.data))
    chosen.close()
    return found


def parse_element(table: TableReader) -> Element | None:
    """Take the array of names and the name of a signal that is one entry of an array."""
    chosen = table.table("element")
    if chosen is None:
        return None
    if len(chosen.data) != 1:
        table.fault(
            '"element" must name one array and one entry of it. Fix: element = { name = "port_joint" }', "element"
        )
        return None
    path, value = next(iter(chosen.data.items()))
    name = chosen.text(path) if isinstance(value, str) else chosen.number(path)
    chosen.close()
    return (path if "[]" in path else f"{path}[]", name)


def parse_pulses(table: TableReader) -> tuple[float, float, float, float] | None:
    """Take the pulses of full astern, neutral and full ahead, and the dead band [us]."""
    pulse = table.numbers("pulse_us", 3, required=True, within=PULSE_LIMITS_US[1])
    dead = table.number("dead_band_us", 0.0, at_least=0.0, within=PULSE_LIMITS_US[1])
    if table.has("offset"):
        table.fault(
            '"offset" has no meaning beside "pulse_us". Fix: correct the second of pulse_us, the neutral', "offset"
        )
    if not pulse:
        return None
    astern, neutral, ahead = pulse
    if not PULSE_LIMITS_US[0] <= astern <= neutral < ahead:
        table.fault(
            f'"pulse_us" must be [full astern, neutral, full ahead] and rise, found {list(pulse)}. '
            "Fix: pulse_us = [1100, 1500, 1900], with sign = -1 for an output that is reversed",
            "pulse_us",
        )
        return None
    if dead >= ahead - neutral or (astern < neutral and dead >= neutral - astern):
        table.fault(
            f'"dead_band_us" = {dead:g} leaves nothing of {list(pulse)}. Fix: give the half of it, on each side of neutral',
            "dead_band_us",
        )
        return None
    return astern, neutral, ahead, dead
