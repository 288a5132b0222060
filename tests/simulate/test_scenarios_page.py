"""The page on writing a scenario: its example works, its faults are real, and it documents every key with its default."""

from __future__ import annotations

import re
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest

from ferryid.effects import effects
from ferryid.errors import FerryIdError
from ferryid.simulate.added_effects import given, simulated
from ferryid.simulate.paths import PATHS
from ferryid.simulate.read_section import FLATTENED
from ferryid.simulate.scenario import MASS, Environment, Scenario, check_against, parse_scenario
from ferryid.simulate.sections import ALWAYS_S, Gains
from ferryid.vessel import load_profile

PAGE = (Path(__file__).parents[2] / "docs" / "scenarios.md").read_text(encoding="utf-8")
EXAMPLE = "\n".join(re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL))
UNITS = {
    "_degpmin": "°/min",
    "_degps2": "°/s²",
    "_degps": "°/s",
    "_radps": "rad/s",
    "_rpmps": "rpm/s",
    "per_mps": "s/m",
    "_mps2": "m/s²",
    "_mps": "m/s",
    "_Npm": "N/m",
    "per_min": "1/min",
    "_ms": "ms",
    "_kg": "kg",
    "_hz": "Hz",
    "_rpm": "rpm",
    "_deg": "°",
    "_m": "m",
    "_s": "s",
}
AT_TOP = ("manoeuvre", "guidance", "controller", "payload", "fouling", "thrusters", "sensors")


def _sections() -> list[tuple[str, type[Any]]]:
    """Return every section with the heading that the page must have for it."""
    found: list[tuple[str, type[Any]]] = [("Gains, in `[controller]`", Gains)]
    start = [("", Scenario, name) for name in AT_TOP] + [
        ("environment.", Environment, f.name) for f in fields(Environment)
    ]
    while start:
        prefix, owner, name = start.pop()
        hint = get_type_hints(owner)[name]
        kind = hint if isinstance(hint, type) else get_args(hint)[0]
        if not is_dataclass(kind) or kind in FLATTENED:
            continue
        found.append((f"`[[{prefix}{name}]]`" if kind is not hint else f"`[{prefix}{name}]`", kind))
        start += [(f"{prefix}{name}.", kind, entry.name) for entry in fields(kind)]
    return found


def _rows(heading: str) -> dict[str, list[str]]:
    """Return the cells of a section's table by key."""
    assert f"### {heading}\n" in PAGE, f"the page has no section {heading}"
    body = PAGE.split(f"### {heading}\n")[1].split("\n### ")[0]
    rows = [
        [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in body.splitlines() if line[:3] == "| `"
    ]
    return {row[0].strip("`"): row for row in rows}


def _shown(default: Any) -> str:
    if isinstance(default, str):
        return f'`"{default}"`'
    if isinstance(default, tuple):
        return "`[" + ", ".join(f"{value:g}" for value in default) + "]`"
    return "`never`" if isinstance(default, float) and default == ALWAYS_S else f"`{default:g}`"


def _number(value: float) -> str:
    return re.sub(r"e([+-])0", r"e\1", f"{value:g}").replace("e+", "e")


@pytest.mark.parametrize(("heading", "kind"), _sections(), ids=lambda value: value if isinstance(value, str) else "")
def test_every_key_stands_there_with_default_unit_and_limits(heading: str, kind: type[Any]) -> None:
    rows = _rows(heading)
    hints = get_type_hints(kind)
    expected = [entry for entry in fields(kind) if hints[entry.name] not in FLATTENED]
    assert list(rows) == [entry.name for entry in expected]
    for entry in expected:
        _, default, unit, limits, meaning = rows[entry.name]
        hint = hints[entry.name]
        assert meaning
        assert unit == next((UNITS[end] for end in UNITS if entry.name.endswith(end)), "")
        if is_dataclass(hint) or (get_args(hint) and is_dataclass(get_args(hint)[0])):
            continue
        assert entry.default is not MISSING
        assert default == _shown(entry.default)
        assert all(f"`{option}`" in limits for option in entry.metadata.get("options", ()))
        if "high" in entry.metadata:
            low, least, high = (_number(entry.metadata[key]) for key in ("low", "least", "high"))
            assert limits == (f"{low} to {high}" if low == least else f"{low}, or {least} to {high}")


def test_every_effect_that_can_be_added_stands_there_with_its_parameters() -> None:
    rows = _rows("`[[effects]]`")
    assert [name for name in simulated() if f"`{name}`" not in rows["effect"][3]] == []
    units: dict[str, list[str]] = {}
    for effect in simulated():
        for one in given(effects()[effect], load_profile("milliampere")):
            units.setdefault(one.name, []).append(one.unit.replace("-", ""))
            assert f"`{effect}`" in rows[one.name][4]
    assert set(rows) == {"effect", "thruster", "from_s", "until_s", *units}
    assert {name: rows[name][2] for name in units} == {
        name: " or ".join(dict.fromkeys(some)) for name, some in units.items()
    }


def test_every_path_and_factor_is_named() -> None:
    assert [kind for kind in (*PATHS, "points") if f"`{kind}`" not in PAGE] == []
    assert [name for name in MASS if f"`{name}`" not in PAGE] == []
    top = _rows("At the top of the file")
    assert set(top) == {"schema", "title", "vessel", "start", "seed", "duration_s"}
    assert set(_rows("`[path]`")) == {"kind", "points", "dwell_s", "size", "rounds"}


def test_example_is_read_and_fits_its_vessel() -> None:
    scenario = parse_scenario(EXAMPLE, "mine.toml")
    check_against(scenario, load_profile(scenario.vessel))
    assert scenario.duration_s == 360.0
    assert scenario.payload[0].mass_kg == 300.0
    assert scenario.thrusters.faults[0].factor == 0.5


def test_faults_shown_are_those_given() -> None:
    shown = [line.removesuffix(" ...") for line in PAGE.splitlines() if line.startswith("mine.toml:")]
    with pytest.raises(FerryIdError) as misspelt:
        parse_scenario(EXAMPLE.replace("gust_std_mps", "gust_sdt_mps"), "mine.toml")
    scenario = parse_scenario(EXAMPLE.replace('"thruster2"', '"thruster3"'), "mine.toml")
    with pytest.raises(FerryIdError) as absent:
        check_against(scenario, load_profile(scenario.vessel))
    given = [str(misspelt.value), str(absent.value)]
    assert len(shown) == 2
    assert all(full.startswith(start) for full, start in zip(given, shown, strict=True)), given
