"""The picture of a planned trial: what an engineer reads from it, and that nothing covers anything else."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ferryid.identifiability.trial import sailing
from ferryid.planning.limits import Limits
from ferryid.planning.plan import Chosen, Expected, Plan, Track
from ferryid.report.plan_figures import picture
from ferryid.simulate import parse_scenario
from ferryid.vessel import load_profile

pytestmark = pytest.mark.draws

STEP_S = 1.0


def planned(manoeuvres: int = 3, least: float = 0.01) -> Plan:
    """Return a plan of circles, the second a different one."""
    angle = np.linspace(0.0, 2.0 * np.pi, 60)
    circle = np.column_stack([10.0 * np.sin(angle), 10.0 * (1.0 - np.cos(angle)), angle])
    poses = np.vstack([np.zeros((10, 3)), *[circle] * manoeuvres])
    chosen = tuple(
        Chosen("weave" if k == 1 else "circle", f"manoeuvre {int(k == 1)}", 10.0 + 60.0 * k, 70.0 + 60.0 * k, 0.1)
        for k in range(manoeuvres)
    )
    scenario = parse_scenario(
        'schema = "ferryid.scenario/1"\nvessel = "milliampere"\n[path]\nkind = "twelve-corner"\n', "x.toml"
    )
    track = Track(poses, STEP_S, Limits((2.0, 1.0, 0.4), (0.3, 0.2, 0.1), 27.0, 17.0), (60.0, 40.0), scenario)
    hull = tuple(Expected(name, "kg", 1.0, 1.0, 0.5, least) for name in ("m11", "X_|u|u"))
    return Plan(sailing(load_profile("milliampere")), chosen, track, 190.0, hull, (), "the usual trial", 49)


def texts(drawing: str) -> list[str]:
    return [one.strip() for one in re.findall(r"<text[^>]*>([^<]*)</text>", drawing)]


def test_equal_manoeuvres_share_a_map_with_their_numbers() -> None:
    told = texts(picture(planned()))
    assert "1, 3  circle" in told
    assert "2  weave" in told
    # And above the motion over time, each once.
    assert {"1", "2", "3"} <= set(told)


def test_numbers_of_manoeuvres_are_above_the_axes_and_apart() -> None:
    for count in (3, 60):
        drawing = picture(planned(count))
        places = [
            (float(x), float(y), k)
            for x, y, k in re.findall(r'<text[^>]*x="([\d.]+)"[^>]*y="([\d.]+)"[^>]*>(\d+)</text>', drawing)
        ]
        heights = {y for _, y, k in places if int(k) <= count and sum(y == other for _, other, _ in places) > 2}
        assert heights
        above = sorted(x for x, y, _ in places if y == min(heights, key=lambda one: one))
        assert min(np.diff(above), default=99.0) > 8.0


@pytest.mark.parametrize("least", [0.01, 1e-4])
def test_what_remains_is_in_percent(least: float) -> None:
    told = texts(picture(planned(least=least)))
    assert {"1 %", "10 %", "100 %"} <= set(told)
    assert not any("e-" in one or "1e" in one for one in told)
    assert {"m11", "X_|u|u", "after the usual trial", "after the planned trial"} <= set(told)


def test_the_ticks_of_a_heading_are_parts_of_turns() -> None:
    told = texts(picture(planned()))
    assert {"0", "180", "360"} <= set(told)
