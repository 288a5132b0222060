"""What ``ferryid simulate`` does: run a scenario, write its log, and say what was written."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from shlex import quote
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError
from ferryid.files import replacing, taken
from ferryid.models import Model
from ferryid.models.store import load_file
from ferryid.simulate.logs import write_log
from ferryid.simulate.output_paths import check_output, log_path
from ferryid.simulate.scenario import Scenario, check_seed, list_scenarios, load_scenario
from ferryid.simulate.trial import Simulation, simulate
from ferryid.simulate.vessel_model import sailed_by
from ferryid.simulate.vessel_topics import matching_profile

SCHEMA = "ferryid.simulate/1"
BESIDE = "# Written by ferryid simulate, to read the log that lies beside it.\n"
"""First line of a profile that is written beside a log: no other file is replaced by one."""
FASTEST_MPS = 15.0
FASTEST_DEGPS = 180.0


def run_scenario(
    scenario: str,
    out: Path,
    *,
    log: Path | None = None,
    storage: str = "sqlite3",
    truth: Path | None = None,
    seed: int | None = None,
    model: Model | None = None,
    conditions: str = "",
    overwrite: bool = False,
    json: Path | None = None,
    progress: Callable[[str], None],
) -> dict[str, Any]:
    """Simulate a scenario, write its log and return what was written (``ferryid.simulate/1``).

    Parameters
    ----------
    scenario
        Name of a bundled scenario, or the path of a TOML file.
    out
        Folder for the log, which is an MCAP file named after the scenario where `log` says nothing else.
    log
        ``*.mcap``, ``*.bag`` (ROS1), or a name without suffix for a ROS2 folder.
    truth, storage, overwrite
        As for `ferryid.simulate.write_log`.
    seed
        Takes the place of the scenario's own.
    model, conditions
        The vessel in the place of the scenario's, and the log whose conditions prevail; see
        `ferryid.simulate.vessel_model.sailed_by`.
    json
        Where the caller will write the result; looked at before anything is simulated.
    progress
        Called with the name of each stage.
    """
    asked = load_scenario(scenario)
    sailing = None
    if model is not None:
        sailing = sailed_by(asked, model, conditions)
        asked, conditions = sailing.scenario, sailing.conditions
    elif conditions:
        raise FerryIdError(
            f"--conditions: {conditions} are conditions of a log that a model was diagnosed on, found no --model. "
            "Fix: give the model as well"
        )
    if seed is not None:
        check_seed(seed)
    inputs = asked.inputs if asked.folder is None else (Path(scenario), *asked.inputs)
    log = log_path(asked.name, out, log)
    check_output(log, truth, storage=storage, overwrite=overwrite, json=json, inputs=inputs)
    progress("simulating (the first run after an installation compiles the simulator, some 20 s)")
    vessel, terms = (None, None) if sailing is None else (sailing.vessel, sailing.terms)
    simulation = simulate(asked, seed, vessel=vessel, terms=terms)
    progress("writing the log")
    unread = _readable(simulation, log, overwrite=overwrite)
    write_log(simulation, log, truth, storage=storage, overwrite=overwrite)
    progress("")
    control = simulation.control
    position_m, heading_deg = _tracking(simulation)
    return {
        "schema": SCHEMA,
        "scenario": asked.name,
        "title": asked.title,
        "vessel": simulation.profile.name,
        "seed": simulation.seed,
        "duration_s": float(len(control.t) / asked.sensors.navigation_rate_hz),
        "log": str(log),
        "truth": None if truth is None else str(truth),
        "topics": {stream.topic: len(stream.stamp_ns) for stream in simulation.streams},
        "tracking_rms": {
            "position_m": position_m,
            "heading_deg": heading_deg,
        },
        "saturated_share": float(np.mean(control.saturated)),
        "undefined_aims": control.undefined_aims,
        "warnings": [
            *(() if sailing is None else sailing.notes),
            *_rejected(asked),
            *_warnings(simulation),
            *unread,
        ],
        **({} if model is None else {"model": model.label, "conditions": conditions or None}),
    }


def _readable(simulation: Simulation, log: Path, *, overwrite: bool) -> list[str]:
    """Write a profile beside a log that the vessel's own cannot read, and say so."""
    if not simulation.faults:
        return []
    place = log.with_name(f"{log.stem}.vessel.toml")
    ours = not os.path.lexists(place) or (place.is_file() and place.read_bytes().startswith(BESIDE.encode()))
    if not ours:
        raise FerryIdError(
            f"{place}: the log needs a profile of that name, which reads it, found another file. Fix: give the log another "
            "name with --log"
        )
    if os.path.lexists(place) and not overwrite:
        raise taken(place)
    with replacing(place, new=not overwrite) as temporary:
        text = matching_profile(simulation.streams, simulation.profile)
        temporary.write_text(BESIDE + text.removeprefix(BESIDE), encoding="utf-8")
    more = f" ({counted(len(simulation.faults) - 1, 'more such topic')})" if len(simulation.faults) > 1 else ""
    return [
        f"the log has the simulator's own topics, as it cannot have the profile's {simulation.faults[0]}{more}. "
        f"Read it with --vessel {quote(str(place))}, which was written beside it"
    ]


def _rejected(scenario: Scenario) -> list[str]:
    """Say where the controller's model is one that its fit did not accept."""
    name = scenario.controller.model
    if not name or load_file(scenario.file(name)).accepted:
        return []
    return [f"the controller's model {name} was rejected by its fit: it steers, but do not trust it"]


def _warnings(simulation: Simulation) -> list[str]:
    """Return what no vessel that ferryid is made for does: more likely a slip in the scenario or the profile."""
    nu = np.abs(simulation.truth.nu)
    speed_mps, turn_degps = float(np.hypot(nu[:, 0], nu[:, 1]).max()), float(np.degrees(nu[:, 2].max()))
    if speed_mps <= FASTEST_MPS and turn_degps <= FASTEST_DEGPS:
        return []
    return [
        f"the motion is not plausible: up to {speed_mps:.3g} m/s and {turn_degps:.3g} deg/s; "
        "look at forces, gains and the hull's damping"
    ]


def _tracking(simulation: Simulation) -> tuple[float | None, float | None]:
    """Return the rms distance [m] and angle [deg] from the reference; None where a manoeuvre has none."""
    if simulation.scenario.manoeuvre.kind:
        return None, None
    truth, control = simulation.truth, simulation.control
    error = truth.eta[:: len(truth.t) // len(control.t)] - control.eta_d
    return (
        float(np.sqrt(np.mean(np.sum(error[:, :2] ** 2, axis=1)))),
        float(np.degrees(np.sqrt(np.mean(error[:, 2] ** 2)))),
    )


def render_simulation(result: Mapping[str, Any]) -> str:
    """Return the result of `run_scenario` as lines for a person."""
    lines = [
        f"{result['title']}",
        f"{result['duration_s']:.0f} s of {result['vessel']}, seed {result['seed']}, written to {result['log']}",
    ]
    if "model" in result:
        held = f", in the conditions of {result['conditions']}" if result["conditions"] else ""
        lines.append(f"the vessel is {result['model']}{held}")
    if result["truth"] is not None:
        lines.append(f"true states: {result['truth']}")
    width = max(len(topic) for topic in result["topics"])
    lines += [f"  {topic:<{width}}  {counted(count, 'message'):>16}" for topic, count in result["topics"].items()]
    rms = result["tracking_rms"]
    if rms["position_m"] is not None:
        lines.append(
            f"kept to its reference within {rms['position_m']:.2f} m and {rms['heading_deg']:.1f} deg (rms), "
            f"thrust saturated {100.0 * result['saturated_share']:.1f} % of the time"
        )
    if result["undefined_aims"]:
        lines.append(
            f"too far from the path for the enclosure law in {result['undefined_aims']} control cycles: it aimed at the "
            "nearest point instead"
        )
    lines += [f"warning: {warning}" for warning in result["warnings"]]
    return "\n".join(lines)


def scenario_listing() -> dict[str, Any]:
    """Return the names and titles of the bundled scenarios (``ferryid.scenarios/1``)."""
    scenarios = [{"name": name, "title": title} for name, title in list_scenarios().items()]
    return {"schema": "ferryid.scenarios/1", "scenarios": scenarios}


def render_scenarios(result: Mapping[str, Any]) -> str:
    """Return the result of `scenario_listing`, one scenario per line with its title."""
    width = max(len(one["name"]) for one in result["scenarios"])
    return "\n".join(f"{one['name']:<{width}}  {one['title']}" for one in result["scenarios"])
