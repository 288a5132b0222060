"""Changes of a scenario that several studies make."""

from __future__ import annotations

from dataclasses import fields, replace

from ferryid.simulate.scenario import Scenario
from ferryid.simulate.sections import Noise


def windier(scenario: Scenario, factor: float) -> Scenario:
    """Return a scenario with steady wind and gusts multiplied by a factor."""
    wind = scenario.wind
    return replace(
        scenario,
        wind=replace(
            wind,
            north_mps=factor * wind.north_mps,
            east_mps=factor * wind.east_mps,
            gust_std_mps=factor * wind.gust_std_mps,
        ),
    )


def rougher(scenario: Scenario, factor: float) -> Scenario:
    """Return a scenario with all waves and wakes higher by a factor."""
    waves = replace(scenario.waves, significant_height_m=factor * scenario.waves.significant_height_m)
    wakes = tuple(replace(wake, height_m=factor * wake.height_m) for wake in scenario.wakes)
    return replace(scenario, waves=waves, wakes=wakes)


def stronger(scenario: Scenario, factor: float) -> Scenario:
    """Return a scenario with the feedback gains multiplied by a factor."""
    gains = scenario.controller.gains
    scaled = {name: tuple(factor * value for value in getattr(gains, name)) for name in ("Kp", "Kd", "Ki")}
    return replace(scenario, controller=replace(scenario.controller, gains=replace(gains, **scaled)))


def noiseless(scenario: Scenario) -> Scenario:
    """Return a scenario with sensors that make no random error."""
    silent = Noise(**{one.name: 0.0 for one in fields(Noise)})
    return replace(scenario, sensors=replace(scenario.sensors, noise=silent))


def prompt(scenario: Scenario) -> Scenario:
    """Return a scenario with thrusters that follow their orders at once."""
    quick = replace(
        scenario.thrusters, speed_lag_s=0.0, azimuth_lag_s=0.0, speed_rate_rpmps=1e6, azimuth_rate_degps=1e6
    )
    return replace(scenario, thrusters=quick)
