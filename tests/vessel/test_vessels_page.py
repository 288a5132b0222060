"""The page on writing a profile: its example works, its faults are real, and it documents every key and unit."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from ferryid.vessel import applied_force, check_profile, load_profile
from ferryid.vessel.parse_actuators import CURVES, KINDS
from ferryid.vessel.parse_hull import DAMPING_TERMS
from ferryid.vessel.parse_signals import ROLE_KINDS, VESSEL_QUANTITIES
from ferryid.vessel.units import KINDS as UNIT_KINDS

PAGE = (Path(__file__).parents[2] / "docs" / "vessels.md").read_text(encoding="utf-8")
EXAMPLE = "\n".join(re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL))


@pytest.fixture
def workboat(tmp_path: Path) -> Path:
    path = tmp_path / "workboat.toml"
    path.write_text(EXAMPLE, encoding="utf-8")
    return path


def test_example_is_free_of_faults_and_gives_forces(workboat: Path) -> None:
    assert check_profile(workboat) == []
    profile = load_profile(workboat)
    columns = {"n_stern": [800.0], "alpha_stern": [np.pi / 2], "n_cmd_bow": [-1000.0]}
    tau = applied_force(profile, {k: np.array(v) for k, v in columns.items()}, np.zeros((1, 3)))[0]
    np.testing.assert_allclose(tau, [[0.0, 440.0 - 120.0, -2.6 * 440.0 - 2.2 * 120.0]], atol=1e-9)


def test_faults_shown_are_those_that_the_check_gives(workboat: Path) -> None:
    text = EXAMPLE.replace('frame = "FLU"', 'frame = "FRU"', 1)
    text = text.replace('"stern.angle"', '"sterm.angle"').replace('unit = "kn"', 'unit = "deg"')
    workboat.write_text(text, encoding="utf-8")
    given = [f"workboat.toml:{fault.line}: {fault.message}" for fault in check_profile(workboat)]
    shown = re.findall(r"^(workboat\.toml:\d+: .*?) \.\.\.$", PAGE, flags=re.MULTILINE)
    assert len(given) == len(shown) == 3
    assert all(full.startswith(start) for full, start in zip(given, shown, strict=True))


def test_every_name_is_documented() -> None:
    names = [
        *KINDS,
        *CURVES,
        *DAMPING_TERMS,
        *(f"<actuator>.{role}" for role in ROLE_KINDS),
        *VESSEL_QUANTITIES,
    ]
    assert [name for name in names if f'"{name}"' not in PAGE and f"`{name}`" not in PAGE] == []
    documented = next(line for line in PAGE.splitlines() if line.startswith("- `unit`:"))
    kinds = ("length", "angle", "speed", "rate", "force", "moment", "mass")
    units = {unit for kind in kinds for unit in UNIT_KINDS[kind]}
    assert units - set(re.split(r"[ :.]+", documented)) == set()
