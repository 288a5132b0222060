"""What surrounds and ails a vessel on one trial: everything that can be concealed, by its physical cause."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

Span = tuple[float, float]
"""From when until when [s]."""
ALWAYS: Span = (0.0, 1e9)


@dataclass(frozen=True)
class Conditions:
    """Conditions of a trial; as they stand here, nothing acts.

    Attributes
    ----------
    wind
        Where the air goes to, north and east [m/s].
    wind_series
        Rows of time [s], and what is added to it then, north and east [m/s]; straight in between, none for no rows.
    gust_std, gust_time
        Of each component about the wind [m/s], and the time scale of Kaimal's spectrum [s].
    current, current_turn
        Where the water goes to, north and east [m/s], and how it turns [deg/min].
    wave_height, wave_period, wave_direction, wave_spread
        Significant height [m], peak period [s], where the sea goes to [deg], and its spread about that [deg].
    wakes
        Of passing boats: time [s], height [m], period [s], duration [s], direction [deg].
    payload, payload_span
        Mass [kg], place forward of midship and height above the waterline [m], and when half of it has come and gone.
    fouling
        Factors on the drag of surge, sway and yaw.
    gain, gain_span
        Factor on the force of thrusters by name, and when it holds.
    azimuth_offset_deg
        By how much thrusters push to the right of where they say, by name.
    azimuth_step_deg
        Step of the azimuths' encoders.
    lag_s
        How late force follows the speed of a propeller.
    inflow
        Share of the thrust that is lost per m/s of water flowing into a propeller at 60 % of its most speed [s/m].
    interaction
        Share of the thrust that is lost in the race of another thruster that blows straight at it.
    mooring, mooring_span
        Stiffness north and east [N/m], place north and east [m], and when the line is on.
    shallow, shallow_m
        Factor on the damping over a bank, and its ends: lowest and highest north, lowest and highest east [m].
    delay_s
        How late the navigation is.
    lever_m
        Where the navigation's point of reference really lies, forward and starboard.
    heading_bias_deg
        By how much the heading is too large.
    yaw_rate_factor
        What the yaw rate is multiplied by.
    noise
        Factor on the errors of the navigation's instruments.
    """

    wind: tuple[float, float] = (0.0, 0.0)
    wind_series: tuple[tuple[float, float, float], ...] = ()
    gust_std: float = 0.0
    gust_time: float = 8.0
    current: tuple[float, float] = (0.0, 0.0)
    current_turn: float = 0.0
    wave_height: float = 0.0
    wave_period: float = 2.5
    wave_direction: float = 0.0
    wave_spread: float = 20.0
    wakes: tuple[tuple[float, float, float, float, float], ...] = ()
    payload: tuple[float, float, float] = (0.0, 0.0, 0.6)
    payload_span: Span = ALWAYS
    fouling: tuple[float, float, float] = (1.0, 1.0, 1.0)
    gain: Mapping[str, float] = field(default_factory=dict)
    gain_span: Span = ALWAYS
    azimuth_offset_deg: Mapping[str, float] = field(default_factory=dict)
    azimuth_step_deg: float = 0.0
    lag_s: float = 0.0
    inflow: float = 0.0
    interaction: float = 0.0
    mooring: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    mooring_span: Span = ALWAYS
    shallow: float = 1.0
    shallow_m: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    delay_s: float = 0.0
    lever_m: tuple[float, float] = (0.0, 0.0)
    heading_bias_deg: float = 0.0
    yaw_rate_factor: float = 1.0
    noise: float = 1.0
