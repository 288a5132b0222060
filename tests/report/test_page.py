"""The report page: verdict first, everything labelled, nothing unescaped."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from importlib.resources import files
from math import inf
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from ferryid.identify.log_condition import KindOutcome, LogCondition
from ferryid.identify.outcome import EstimatorScore, FitOutcome
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.models.store.versions import StoredModel
from ferryid.report.fit_report import as_json, as_text
from ferryid.report.headline import headline_of
from ferryid.report.page import _held, render
from ferryid.types import RunContext
from ferryid.vessel import load_profile

pytestmark = pytest.mark.slow

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> FitOutcome:
    settings = FitSettings(delta=0.4, sigma=0.4, draws=40)
    return fit_logs(
        [str(FIXTURES / "short.bag")], load_profile("milliampere"), settings, RunContext(tmp_path_factory.mktemp("out"))
    )


@pytest.fixture(scope="module")
def rendered(result: FitOutcome) -> tuple[str, dict[str, str]]:
    """Page and drawings of it."""
    return render(result)


class Structure(HTMLParser):
    """Collects headings, captions and unclosed tags."""

    VOID = frozenset(("meta", "br", "hr", "img", "link"))

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.captions = 0
        self.figures = 0

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag not in self.VOID:
            self.open.append(tag)
        self.captions += tag == "figcaption"
        self.figures += tag == "figure"

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_is_well_formed_and_every_figure_has_a_caption(rendered: tuple[str, dict[str, str]]) -> None:
    page, drawings = rendered
    structure = Structure()
    structure.feed(page)
    assert structure.open == []
    assert structure.figures == structure.captions == len(drawings) >= 9


def test_verdict_comes_before_any_figure(result: FitOutcome, rendered: tuple[str, dict[str, str]]) -> None:
    page = html.unescape(rendered[0])
    assert page.index(headline_of(result)) < page.index("<svg")


def test_conditions_that_the_data_say_nothing_of_are_counted_apart() -> None:
    assert _held([True, True, None]) == "2 of 2 hold, 1 could not be judged"
    assert _held([True, False]) == "1 of 2 hold"


@pytest.mark.parametrize(
    ("r2", "change", "scale", "told"),
    [
        (
            (0.96, 0.91, 0.99),
            0.98,
            {},
            " Nothing to improve: the base model fits already (R² 0.91 or more on every axis).",
        ),
        (
            (0.96, 0.91, np.nan),
            1.03,
            {},
            " Nothing to improve: the base model fits already (R² 0.91 or more on every axis).",
        ),
        ((0.96, 0.89, 0.99), 0.98, {}, ""),
        ((0.96, 0.91, 0.99), 1.06, {}, ""),
        ((0.96, 0.91, 0.99), 0.98, {"delta": 0.4}, ""),
    ],
)
def test_where_the_base_model_fits_already_there_is_nothing_to_improve(
    result: FitOutcome, r2: tuple[float, ...], change: float, scale: dict[str, float], told: str
) -> None:
    fitting = replace(result.scores, force=replace(result.scores.force, r2_base=np.array(r2)))
    rejected = replace(result.acceptance, accepted=False, normalised_mse=change)
    one = replace(result, scores=fitting, acceptance=rejected, model=replace(result.model, scale=scale))
    assert ("Nothing to improve" in headline_of(one)) == bool(told)
    assert headline_of(one).endswith(told)


@pytest.mark.blank
def test_a_model_that_is_not_accepted_is_told_so(result: FitOutcome) -> None:
    rejected = replace(result, acceptance=replace(result.acceptance, accepted=False))
    assert "Not accepted" in render(rejected)[0]


def test_an_estimator_without_a_model_on_the_folds_is_said_to_be_without_one(
    result: FitOutcome, tmp_path: Path
) -> None:
    scores = (
        EstimatorScore("weak", inf, 0.11, False, possible=False),
        EstimatorScore("derivative", 0.063, 0.212, True),
    )
    compared = replace(result, estimators=scores)
    page = render(compared)[0]
    assert (
        "<td>weak, with inertia or damping that no hull has</td><td>unknown, too short for it</td><td>0.110</td>"
        in page
    )
    told = as_text(compared, StoredModel(tmp_path / "1.json", compared.model, current=False), None)
    assert (
        "model's: unknown on folds of the training rows, which are too short for it, 0.110 held out; no hull has such"
        in told
    )
    assert "model's: 0.063 on folds of the training rows, 0.212 held out; chosen" in told
    # Beside a base model that errs by hardly anything on the folds.
    huge = replace(result, estimators=(EstimatorScore("weak", 560286861189.98, 2.486, True),))
    told = as_text(huge, StoredModel(tmp_path / "1.json", huge.model, current=False), None)
    assert "model's: 5.6e+11 on folds of the training rows, 2.486 held out; chosen" in told
    assert "<td>weak, used</td><td>5.6e+11</td><td>2.486</td>" in render(huge)[0]


def test_conditions_of_single_logs_stand_on_the_page_in_the_text_and_in_the_json(
    result: FitOutcome, tmp_path: Path
) -> None:
    current = LogCondition(
        "monday", "current", "current", ("north", "east"), ("m/s", "m/s"), np.array([0.2, -0.1]), 1e-4 * np.eye(2)
    )
    found = replace(
        result,
        conditions=(current, replace(current, log="tuesday", values=np.zeros(2))),
        condition_kinds=(
            KindOutcome(
                "current", "current", True, "its log evidence over none is 20.0 nat", (("north", 0.1, "m/s"),), 20.0
            ),
            KindOutcome("payload", "load", False, "the profile has no hull model"),
        ),
    )
    page = html.unescape(render(found)[0])
    assert "<li>current, monday: north 0.2 (0.18 to 0.22) m/s" in page
    assert "<li>load: not estimated, as the profile has no hull model</li>" in page
    assert "Other conditions of single logs" not in render(result)[0]
    stored = StoredModel(tmp_path / "1.json", found.model, current=False)
    lines = as_text(found, stored, None).splitlines()
    assert "current, estimated: monday: north 0.2 (0.18 to 0.22) m/s, east -0.1 (-0.12 to -0.0804) m/s" in lines
    assert "current, estimated: tuesday: not distinguishable from zero" in lines
    plain = json.loads(json.dumps(as_json(found, stored, None)))
    schema = json.loads(files("ferryid.schemas").joinpath("fit.json").read_text(encoding="utf-8"))
    jsonschema.validate(plain["conditions"], schema["properties"]["conditions"])
    jsonschema.validate(plain["condition_kinds"], schema["properties"]["condition_kinds"])
    assert [one["included"] for one in plain["condition_kinds"]] == [True, False]


def test_logs_that_are_left_out_stand_in_the_json_and_on_the_page(result: FitOutcome, tmp_path: Path) -> None:
    said = "Left out of the fit: b.csv: no common hull fits it and the 8 other logs. Fix: fit it by itself"
    found = replace(result, warnings=(*result.warnings, said), logs_left_out={"b.csv": said})
    stored = StoredModel(tmp_path / "1.json", found.model, current=False)
    plain = json.loads(json.dumps(as_json(found, stored, None)))
    assert plain["logs_left_out"] == [{"log": "b.csv", "says": said}]
    schema = json.loads(files("ferryid.schemas").joinpath("fit.json").read_text(encoding="utf-8"))
    jsonschema.validate(plain["logs_left_out"], schema["properties"]["logs_left_out"])
    assert "logs_left_out" not in as_json(result, stored, None)
    assert f'<div class="warning">{said}</div>' in render(found)[0]
    assert f"warning: {said}" in as_text(found, stored, None).splitlines()


def test_loads_of_single_logs_are_said_to_be_relative(result: FitOutcome, tmp_path: Path) -> None:
    load = LogCondition(
        "monday", "payload", "load", ("mass", "moment"), ("kg", "kg·m"), np.array([80.0, 0.0]), np.eye(2)
    )
    kinds = (KindOutcome("payload", "load", True, "its log evidence over none is 20.0 nat"),)
    told = (
        "loads are relative to the hull that all logs share, positive or negative: what was aboard in every log is in"
    )
    for found, shown in (
        (replace(result, conditions=(load,), condition_kinds=kinds), True),
        (replace(result, conditions=(replace(load, kind="current"),), condition_kinds=kinds), False),
    ):
        text = as_text(found, StoredModel(tmp_path / "1.json", found.model, current=False), None)
        assert (told in text) == shown
    assert "Loads are relative to the hull" in render(replace(result, conditions=(load,), condition_kinds=kinds))[0]


def test_it_is_said_from_which_rows_errors_and_coefficients_are(result: FitOutcome, tmp_path: Path) -> None:
    for settings, shown in (({"estimated_from": "all rows"}, True), ({}, False)):
        kept = {name: value for name, value in result.model.settings.items() if name != "estimated_from"}
        found = replace(result, model=replace(result.model, settings={**kept, **settings}))
        text = as_text(found, StoredModel(tmp_path / "1.json", found.model, current=False), None)
        assert ("errors are those of a fit to the training rows alone" in text) == shown
        assert ("Errors are those of a fit to the training rows alone" in render(found)[0]) == shown


def test_names_of_logs_and_warnings_are_escaped(result: FitOutcome) -> None:
    log = result.logs[0]
    evil = "<script>alert(1)</script>"
    strange = replace(result, logs=(replace(log, motion=replace(log.motion, log=evil)),), warnings=(evil,))
    page, _ = render(strange)
    assert evil not in page
    assert "&lt;script&gt;" in page


def test_axes_carry_units(rendered: tuple[str, dict[str, str]]) -> None:
    _, drawings = rendered
    forces = next(svg for name, svg in drawings.items() if name.startswith("forces"))
    for label in ("surge X [N]", "sway Y [N]", "yaw N [N·m]", "time [s]", "measured", "base model", "new model"):
        assert f">{label}</text>" in forces
    for name, unit in (
        ("free-run-errors", "position [m]"),
        ("residual-spectrum", "frequency [Hz]"),
        ("track", "north [m]"),
    ):
        assert unit in drawings[name]


def test_the_same_result_gives_the_same_page(result: FitOutcome, rendered: tuple[str, dict[str, str]]) -> None:
    assert render(result)[0] == rendered[0]


def test_numbers_on_the_page_are_those_of_the_model(result: FitOutcome, rendered: tuple[str, dict[str, str]]) -> None:
    page = re.sub(r"<svg.*?</svg>", "", rendered[0], flags=re.DOTALL)
    for ratio in result.scores.force.ratio:
        assert f"<td>{ratio:.3f}</td>" in page
    assert result.model.training[0]["sha256"] in page
