"""What the parameters of an autopilot state of its boat, and which value counts where a log has several."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ferryid.draft.samples import Samples
from ferryid.ingest.parameters import Parameter

SHOWN_CHANGES = 5
"""Values that are listed of a parameter that changes in a log."""


@dataclass(frozen=True)
class OutputSetting:
    """What parameters state of one output.

    Attributes
    ----------
    in_pulses
        Whether it is a pulse that goes both ways from a neutral, with a stated sign; else there is nothing but evidence.
    pulse_us
        Pulses of full astern, neutral and full ahead, and the dead band on each side of neutral [us]; None where they are not
        stated, or contradict each other.
    sign
        -1 where pulses above neutral order astern or port.
    sign_by
        The parameter that states the sign.
    full_deg
        Angle at full travel [deg], 0 where it is not stated.
    pushes_ahead
        Whether the output drives a thruster that pushes ahead at positive orders.
    evidence, doubts
        What is stated, and what a person has to check, a sentence each.
    """

    in_pulses: bool = False
    pulse_us: tuple[float, float, float, float] | None = None
    sign: float = 1.0
    sign_by: str = ""
    full_deg: float = 0.0
    pushes_ahead: bool = False
    evidence: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Placement:
    """What parameters state of a thruster itself.

    Attributes
    ----------
    kind
        As of `ferryid.vessel.profile.Actuator`; empty where its signals decide.
    position_m
        Metres ahead and to starboard; None where it is not stated.
    hint_m
        An example of such a position.
    angle_deg
        Where it pushes to, clockwise from ahead; None where it is not stated.
    turns
        1 where it turns the vessel to starboard by a positive order, -1 to port, 0 where that is not stated.
    count
        Thrusters that follow this order.
    evidence, doubts
        As of `OutputSetting`.
    """

    kind: str = ""
    position_m: tuple[float, float] | None = None
    hint_m: tuple[float, float] = (-2.0, 0.0)
    angle_deg: float | None = None
    turns: int = 0
    count: int = 1
    evidence: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()


NOT_STATED = Placement()


@dataclass
class UsedValues:
    """The value of each parameter that holds for the longest part of what is used of a log.

    Attributes
    ----------
    remarks
        Parameters that were asked for and of which the log has several values, a sentence each.
    """

    parameters: Mapping[str, Parameter]
    samples: Samples
    remarks: dict[str, str] = field(default_factory=dict)

    def get(self, name: str) -> float | None:
        """Return the value of a parameter, None where the log does not have it."""
        one = self.parameters.get(name)
        if one is None:
            return None
        known = np.isfinite(one.values)
        if not known.all():
            self.remarks[f"{name}, no number"] = f"{name} is no number in the log: such values are not used"
            one = Parameter(one.time_ns[known], one.values[known])
        values = np.unique(one.values)
        if not values.size:
            return None
        if values.size == 1:
            return float(values[0])
        grid = self.samples.grid_s if self.samples.used is None else self.samples.grid_s[self.samples.used]
        set_s = (one.time_ns - self.samples.start_ns) * 1e-9
        order = np.argsort(set_s, kind="stable")
        held = one.values[order][np.clip(np.searchsorted(set_s[order], grid, side="right") - 1, 0, None)]
        used = float(max(values, key=lambda value: np.count_nonzero(held == value)))
        changes = [k for k in range(len(order)) if k == 0 or one.values[order[k]] != one.values[order[k - 1]]]
        shown = [f"{one.values[order[0]]:g} at first"]
        shown += [
            f"{one.values[order[k]]:g} from {max(set_s[order[k]], 0.0):.1f} s on" for k in changes[1:SHOWN_CHANGES]
        ]
        if len(changes) > SHOWN_CHANGES:
            shown.append(f"{len(changes) - SHOWN_CHANGES} more")
        self.remarks[name] = f"{name} changed in the log: {', '.join(shown)}; {used:g} held longest and is used"
        return used

    def whole(self, name: str) -> int | None:
        """Return the value of a parameter that is a whole number, None where the log does not have it, or another one."""
        value = self.get(name)
        if value is not None and value != round(value):
            self.remarks[name] = f"{name} = {value:g} is no whole number, and is not used"
            return None
        return None if value is None else round(value)
