"""Results as pandas tables: a row for each value with its interval, whatever the form."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from ferryid.report.outcome import Outcome, Report
from ferryid.report.tables import tables_of
from tests.batch.rows import finding, result, row


def sizes(**values: float) -> dict[str, dict[str, object]]:
    return {name: {"value": v, "low": v - 1.0, "high": v + 1.0, "unit": "m/s"} for name, v in values.items()}


def diagnosed(log: str) -> dict[str, object]:
    where = {"onset": 20.0, "offset": None}
    return {
        "log": log,
        "verdict": "explained",
        "duration_s": 60.0,
        "findings": [
            {
                "effect": "wind",
                "instance": None,
                "probability": 0.9,
                "where": where,
                "parameters": sizes(north=3.0, east=4.0),
            },
            {"effect": "unknown", "instance": None, "probability": 0.5, "where": where, "parameters": {}},
        ],
        "before": {"mse": {"surge": 4.0, "sway": None, "yaw": 1.0}},
        "after": {
            "mse": {"surge": 1.0, "sway": None, "yaw": 1.0},
            "ratio": {"surge": {"value": 0.25, "low": 0.2, "high": 0.3}},
        },
        "withheld": [{"signal": "wind", "found": sizes(north=3.0), "measured": {"north": 3.5, "east": 4.5}}],
        "likeness": {
            "pairs": [
                {
                    "effects": [{"effect": "wind", "instance": None}, {"effect": "lag", "instance": "bow"}],
                    "likeness": 0.9,
                }
            ]
        },
    }


def test_a_diagnosis_of_one_log_and_of_several() -> None:
    one = tables_of({"schema": "ferryid.diagnosis/1", **diagnosed("a")})
    assert one["findings"]["parameter"].tolist()[:2] == ["north", "east"]
    assert one["findings"].loc[0, ["value", "low", "high", "unit", "probability", "onset"]].tolist() == [
        3.0, 2.0, 4.0, "m/s", 0.9, 20.0,
    ]  # fmt: skip
    assert one["errors"]["axis"].tolist() == ["surge", "yaw"]
    assert one["errors"].loc[0, ["before", "after", "ratio", "high"]].tolist() == [4.0, 1.0, 0.25, 0.3]
    assert one["withheld"]["measured"].tolist() == [3.5, 4.5]
    assert one["alike"].loc[0, ["first", "second", "likeness"]].tolist() == ["wind", "lag (bow)", 0.9]
    several = tables_of({"schema": "ferryid.diagnosis/1", "log": None, "logs": [diagnosed("a"), diagnosed("b")]})
    assert several["logs"]["log"].tolist() == ["a", "b"]
    assert len(several["findings"]) == 2 * len(one["findings"])


def test_a_batch() -> None:
    rows = [row("x/day1", 1, findings=(finding("wind", north=3.0, east=4.0),)), row("x/day2", 2)]
    tables = tables_of(result(*rows).to_json())
    assert tables["logs"]["name"].tolist() == ["day1", "day2"]
    assert tables["findings"][["log", "parameter", "value"]].to_numpy().tolist() == [
        ["day1", "north", 3.0],
        ["day1", "east", 4.0],
    ]
    assert "trends" not in tables


def test_groups() -> None:
    one = {"effect": "payload", "instance": None, "group": "B", "probability": 0.9, "confirmed": True}
    tables = tables_of(
        {
            "schema": "ferryid.versus/1",
            "differences": [{**one, "parameters": sizes(mass=100.0)}],
            "compared": [{**one, "effect": "fouling", "confirmed": False, "parameters": sizes(surge=1.0)}],
            "loads": [],
        }
    )
    assert tables["differences"][["effect", "value", "found", "confirmed"]].to_numpy().tolist() == [
        ["payload", 100.0, True, True],
        ["fouling", 1.0, False, False],
    ]
    assert "loads" not in tables


def test_a_form_without_rows_has_no_tables() -> None:
    assert Outcome({"schema": "ferryid.simulate/1"}, "").tables == {}
    assert Outcome({}, "").tables == {}


def test_a_report_has_its_figures(tmp_path: Path) -> None:
    for name in ("forces.svg", "path.svg", "report.html"):
        (tmp_path / name).write_text("<svg/>", encoding="utf-8")
    assert Report({}, "", tmp_path / "report.html").figures == {
        "forces": tmp_path / "forces.svg",
        "path": tmp_path / "path.svg",
    }


def test_tables_are_those_of_pandas() -> None:
    (table,) = tables_of(
        {"schema": "ferryid.models/1", "models": [{"name": "m", "version": 1, "logs": ["a"]}]}
    ).values()
    assert isinstance(table, pd.DataFrame)
    assert table.columns.tolist() == ["name", "version"]
