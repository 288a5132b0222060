"""The public Python API: a call for each command, which the commands go through, and results that show themselves."""

from __future__ import annotations

import ast
import inspect
import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

import ferryid
from ferryid import api
from ferryid.errors import FerryIdError
from ferryid.identify import FitSettings
from ferryid.report import outcome as outcome_module
from ferryid.report.outcome import Outcome
from ferryid.side_by_side import THREADS_OF_BLAS
from ferryid.vessel import load_profile

pytestmark = pytest.mark.draws

ROOT = Path(__file__).resolve().parents[1]
SHORT = ROOT / "fixtures" / "short.mcap"


def test_every_call_has_a_command_that_makes_it() -> None:
    calls = {
        node.func.attr
        for path in (ROOT / "cli").glob("cmd_*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and ast.unparse(node.func.value) == "api"
    }
    assert calls == set(api.__all__)


def test_every_call_is_typed_and_documented() -> None:
    for name in api.__all__:
        call = getattr(api, name)
        assert inspect.getdoc(call), name
        assert all(one.annotation is not one.empty for one in inspect.signature(call).parameters.values()), name
        assert inspect.signature(call).return_annotation in ("Outcome", "Report", "FitReport"), name


def test_importing_it_imports_nothing_heavy() -> None:
    code = "import sys, ferryid.api; print([name for name in ('numpy', 'pandas', 'typer') if name in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_who_looks_for_a_call_in_the_package_is_told_where_it_is() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'fit': .* are in ferryid\.api \(from ferryid import api\)"):
        ferryid.fit  # noqa: B018
    assert not hasattr(ferryid, "sweep")


@pytest.mark.slow
def test_from_a_log_to_a_comparison(tmp_path: Path) -> None:
    seen = api.inspect(SHORT, "milliampere")
    assert seen.json["schema"] == "ferryid.inspect/1"
    stages: list[str] = []
    fitted = api.fit(SHORT, "milliampere", out=tmp_path, progress=stages.append)
    assert fitted.json["scores"]["normalised_mse"] == fitted.stored.model.scores.to_json()["normalised_mse"]
    assert fitted.report == tmp_path / "reports" / "milliampere-v1" / "report.html"
    assert str(fitted) == fitted.text
    assert stages[-1] == ""
    assert "milliampere" in str(api.models(tmp_path))
    # A model in hand, and its name in the store.
    by_name, by_model = (
        api.evaluate(model, [SHORT], tmp_path).json["logs"] for model in ("milliampere", fitted.stored.model)
    )
    assert by_name == by_model
    assert api.show_model("milliampere@1", tmp_path).json == api.show_model(fitted.stored.model, tmp_path).json
    api.fit([SHORT], load_profile("milliampere"), FitSettings(window_s=2.0), tmp_path)
    compared = api.compare(["milliampere@1", "milliampere@2"], SHORT, tmp_path)
    assert compared.report.exists()
    # Results as tables: what the model file has, and what the page shows.
    tables = fitted.tables
    assert {"coefficients", "scores", "free_runs", "checks", "logs"} <= set(tables)
    model = fitted.stored.model
    yaw = tables["coefficients"].query("axis == 'yaw'").set_index("term")
    assert yaw.loc[list(model.terms), "low"].tolist() == model.low[:, 2].tolist()
    assert tables["scores"]["mse_model"].tolist() == list(fitted.json["scores"]["mse"]["model"].values())
    assert set(compared.tables) >= {"ratios", "coefficients", "models"}
    assert api.evaluate("milliampere", [SHORT], tmp_path).tables["scores"]["log"].tolist() == ["short"] * 3
    assert api.models(tmp_path).tables["models"]["version"].tolist() == [1, 2]
    assert set(fitted.figures) == {one.stem for one in fitted.report.parent.glob("*.svg")}


def test_a_log_beside_an_unfinished_draft_is_inspected(tmp_path: Path) -> None:
    shutil.copy(SHORT, tmp_path)
    draft = tmp_path / "vessel.toml"
    draft.write_text("[vessel]\nname = 'mine'\n\n[hull]\n# FILL IN\n# mass_kg =\n")
    said: list[str] = []
    seen = api.inspect(tmp_path / SHORT.name, announce=said.append)
    assert seen.json["topics"]
    (line,) = said
    assert line.startswith(f"no profile is used: {draft}")
    with pytest.raises(FerryIdError):
        api.inspect(tmp_path / SHORT.name, draft)


def test_a_notebook_shows_the_page_or_the_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert outcome_module.Outcome({}, "a < b")._repr_html_() == "<pre>a &lt; b</pre>"
    page = tmp_path / "report.html"
    page.write_text('<p title="x">page</p>', encoding="utf-8")
    made = outcome_module.Report({}, "a < b", page)
    assert 'srcdoc="&lt;p title=&quot;x&quot;&gt;page&lt;/p&gt;"' in made._repr_html_()
    monkeypatch.setattr(outcome_module, "LARGEST_SHOWN", 3)
    assert "srcdoc" not in made._repr_html_()
    assert page.as_uri() in made._repr_html_()


def test_what_cannot_be_used_is_refused_as_by_the_commands(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match="no such file or folder"):
        api.fit(tmp_path / "missing.mcap", "milliampere", out=tmp_path)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("vessel", [None, "milliampere"])
def test_a_call_without_a_log_is_refused(vessel: str | None, tmp_path: Path) -> None:
    calls = (api.fit, partial(api.sweep, "components"), api.diagnose)
    for call in calls:
        with pytest.raises(FerryIdError, match=r"no log was given\. Fix: name one"):
            call([], vessel=vessel, out=tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_session_shows_one_line_of_a_result() -> None:
    assert repr(Outcome({"schema": "ferryid.fit/1", "rows": [0] * 9000}, "Accepted: yes\nand more")) == (
        "<ferryid.fit/1: Accepted: yes>"
    )


def test_the_types_that_signatures_name_are_where_the_calls_are() -> None:
    signature = inspect.signature(api.fit)
    for name in ("Logs", "Ranges", "Progress"):
        assert name in {parameter.annotation for parameter in signature.parameters.values()}
        assert hasattr(api, name)
    assert signature.parameters["out"].default is api.OUT


@pytest.mark.parametrize(("chosen", "threads"), [({}, 1), ({"OPENBLAS_NUM_THREADS": "2"}, 2)])
def test_matrix_products_take_one_thread_within_a_call_but_where_the_user_chose(
    chosen: dict[str, str], threads: int
) -> None:
    code = (
        "import numpy, scipy.linalg\n"
        "from threadpoolctl import threadpool_info, threadpool_limits\n"
        "from ferryid.side_by_side import blas_on_one_thread\n"
        "threads = lambda: {one['num_threads'] for one in threadpool_info() if one['user_api'] == 'blas'}\n"
        "threadpool_limits(2, user_api='blas')\n"
        "print(blas_on_one_thread(threads)(), threads())\n"
    )
    environment = {name: value for name, value in os.environ.items() if name not in THREADS_OF_BLAS}
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**environment, **chosen}
    )
    assert found.stdout.strip() == f"{{{threads}}} {{2}}"


def test_every_call_that_estimates_keeps_matrix_products_to_one_thread() -> None:
    estimate = (
        "batch",
        "compare",
        "compare_groups",
        "diagnose",
        "evaluate",
        "fit",
        "plan",
        "prove",
        "reproduce",
        "sweep",
    )
    assert {name for name in api.__all__ if hasattr(getattr(api, name), "__wrapped__")} == set(estimate)
