"""The built-in simulator: a vessel under control, its sensors, and logs like recordings.

Nothing heavy is imported until something is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ferryid.simulate.commands import render_scenarios, render_simulation, run_scenario, scenario_listing
    from ferryid.simulate.logs import write_log
    from ferryid.simulate.scenario import Scenario, list_scenarios, load_scenario, parse_scenario
    from ferryid.simulate.trial import Simulation, simulate

_HOMES = {
    "Scenario": "scenario",
    "Simulation": "trial",
    "list_scenarios": "scenario",
    "load_scenario": "scenario",
    "parse_scenario": "scenario",
    "render_scenarios": "commands",
    "render_simulation": "commands",
    "run_scenario": "commands",
    "scenario_listing": "commands",
    "simulate": "trial",
    "write_log": "logs",
}

__all__ = [
    "Scenario",
    "Simulation",
    "list_scenarios",
    "load_scenario",
    "parse_scenario",
    "render_scenarios",
    "render_simulation",
    "run_scenario",
    "scenario_listing",
    "simulate",
    "write_log",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
