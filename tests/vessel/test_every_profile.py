"""Every bundled profile loads without a fault and states a unit for every signal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ferryid.vessel import bundled, check_profile, describe, given_as, load_profile, parse_profile


@pytest.mark.parametrize("name", bundled())
def test_profile_is_free_of_faults(name: str) -> None:
    assert check_profile(name) == []


@pytest.mark.parametrize("name", bundled())
def test_profile_states_units_and_source(name: str) -> None:
    profile = load_profile(name)
    assert profile.name == name
    assert len(profile.source) > 20
    assert all(signal.unit for signal in profile.signals)
    assert np.all(np.linalg.eigvalsh(0.5 * (profile.hull.M + profile.hull.M.T)) > 0.0)


@pytest.mark.parametrize("name", bundled())
def test_description_names_every_part(name: str) -> None:
    profile = load_profile(name)
    text = describe(profile)
    lines = [line.strip() for line in text.splitlines()]
    for start in (f"{part.name}: {part.kind.partition('_')[0]}" for part in profile.actuators):
        assert any(line.startswith(start) for line in lines)
    for signal in profile.signals:
        row = next(line for line in lines if line.startswith(f"{signal.quantity} "))
        assert signal.topic in row
        assert signal.unit in row


def test_a_profile_is_given_by_its_file_or_by_its_name(tmp_path: Path) -> None:
    bundled = load_profile("milliampere")
    assert given_as(bundled) == "milliampere"
    own = tmp_path / "vessel.toml"
    own.write_text(bundled.text, encoding="utf-8")
    assert given_as(load_profile(own)) == str(own)
    # A model brings its profile along under its own name: what no file and no name leads to is no word for a command.
    inside = bundled.text.replace('name = "milliampere"', 'name = "gu"')
    assert given_as(parse_profile(bundled.text, "a-model")) == "milliampere"
    assert given_as(parse_profile(inside, "a-model")) == ""
    assert given_as(parse_profile(bundled.text + "\n# Changed.", "a-model")) == ""
