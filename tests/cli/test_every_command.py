"""Every command: help, documentation, and JSON output that keeps to its published schema."""

from __future__ import annotations

import json
import pkgutil
import re
from importlib.resources import files
from pathlib import Path
from urllib.parse import unquote

import jsonschema
import pytest

import ferryid.cli
from ferryid.regression.bases.forms import basis_names
from tests.command_line.in_process import Run, invoke
from tests.report.pages import needs_nothing

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]
FIXTURES = ROOT / "fixtures"
COMMANDS = sorted(
    module.name.removeprefix("cmd_")
    for module in pkgutil.iter_modules(ferryid.cli.__path__)
    if module.name[:4] == "cmd_"
)
SCALE = ("--delta", "0.4", "--sigma", "0.4")
THESIS = ("--accept", "thesis")
"""The fixtures are too short for a verdict on more than the error."""


def conforms(text: str) -> dict:
    """Check a JSON result against the schema that it names."""
    data = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    name = data["schema"].removeprefix("ferryid.").removesuffix("/1")
    schema = json.loads(files("ferryid.schemas").joinpath(f"{name}.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(data, schema)
    return data


@pytest.mark.parametrize("command", COMMANDS)
def test_has_help_and_is_documented(ferryid, command: str) -> None:
    run = ferryid(command, "--help")
    assert run.code == 0
    assert len(run.out.split("\n\n")[0]) > 20
    assert f"ferryid {command}" in (ROOT / "docs" / "guide.md").read_text(encoding="utf-8")


def test_shell_completion_knows_what_there_is(ferryid, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name, numbers in (("boat", (1, 2, 10)), ("other", (1,))):
        (tmp_path / "out" / "models" / name).mkdir(parents=True)
        for number in numbers:
            (tmp_path / "out" / "models" / name / f"{number}.json").touch()
    (tmp_path / "trial.mcap").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("_FERRYID_COMPLETE", "complete_bash")
    for typed, offered in (
        ("ferryid s", ["simulate", "sweep"]),
        ("ferryid sweep --win", ["--windows", "--window"]),
        ("ferryid fit --vessel re", ["revolt"]),
        ("ferryid vessel new --like es", ["esso-osaka"]),
        ("ferryid evaluate --out out b", ["boat"]),
        ("ferryid evaluate --out out boat@", ["boat@1", "boat@2", "boat@10"]),
        ("ferryid diagnose trial.mcap --out out --model ot", ["other"]),
        ("ferryid simulate --models out --model ot", ["other"]),
        ("ferryid compare --out out bo", ["boat"]),
        ("ferryid models --out out o", ["other", "out/"]),
        ("ferryid export tri", ["trial.mcap"]),
        ("ferryid export boat --to g", ["gazebo"]),
        ("ferryid simulate four", ["four-corner"]),
        ("ferryid prove --only wind,pay", ["wind,payload"]),
    ):
        monkeypatch.setenv("COMP_WORDS", typed)
        monkeypatch.setenv("COMP_CWORD", str(typed.count(" ")))
        assert ferryid().out.split() == offered, typed


@pytest.mark.parametrize(
    "log", ["short.mcap", "short.bag", "short_ros2", "short_ros2_mcap", "truncated.mcap", "short.csv"]
)
@pytest.mark.parametrize("vessel", [(), ("--vessel", "milliampere")])
def test_inspect(ferryid, fixtures: Path, log: str, vessel: tuple[str, ...]) -> None:
    run = ferryid("inspect", fixtures / log, *vessel, "--json", "-")
    assert run.code == 0, run.err
    assert conforms(run.out)["messages"] > 0


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Run]:
    """Return an output folder with the models milliampere@1 and @2, and what the fit of the first printed."""
    out = tmp_path_factory.mktemp("fitted") / "out"
    words = ("fit", FIXTURES / "short.mcap", "--vessel", "milliampere", *SCALE, *THESIS, "--out", out)
    first = invoke(*words, "--json", "-")
    assert invoke(*words, "--basis", "thesis", "--structure", "coupled", "--no-report").code == 0
    return out, first


@pytest.fixture(scope="module")
def compared(fitted: tuple[Path, Run]) -> Run:
    """Return what the comparison of the two printed."""
    logs = ("--on", FIXTURES / "short.mcap", FIXTURES / "second.bag")
    return invoke("compare", "milliampere@1", "milliampere@2", *logs, "--out", fitted[0], "--json", "-")


@pytest.mark.draws
def test_ingest_fit_evaluate_compare_and_models(
    ferryid, fixtures: Path, fitted: tuple[Path, Run], compared: Run
) -> None:
    log, other, (out, run) = fixtures / "short.mcap", fixtures / "second.bag", fitted

    fit = conforms(run.out)
    assert run.code == 0
    assert fit["model"]["accepted"], fit["reasons"]
    page = Path(fit["report"]).read_text(encoding="utf-8")
    assert page.count("<svg") > 8
    assert needs_nothing(page)
    conforms(Path(fit["model"]["path"]).read_text(encoding="utf-8"))
    conforms((Path(fit["report"]).parent / "fit.json").read_text(encoding="utf-8"))

    run = ferryid("ingest", log, "--vessel", "milliampere", "--out", out, "--json", "-")
    tables = conforms(run.out)["logs"][0]
    assert {table["topic"] for table in tables["tables"]} >= {"/navigation/odometry", "/thruster1/state"}
    assert len(list(Path(tables["folder"]).glob("*.parquet"))) == len(tables["tables"])

    evaluation = conforms(ferryid("evaluate", "milliampere@1", other, "--out", out, "--json", "-").out)
    assert evaluation["logs"][0]["normalised_mse"] < 1.0
    assert evaluation["logs"][0]["per_axis"] == evaluation["pooled"]["per_axis"]
    runs = evaluation["logs"][0]["free_run"]
    assert runs["model"]["position_m"][0] < runs["base"]["position_m"][0]

    comparison = conforms(compared.out)
    assert [model["label"] for model in comparison["models"]] == ["base model", "milliampere@1", "milliampere@2"]
    assert [entry["scores"]["milliampere@2"]["trained"] for entry in comparison["logs"]] == [True, False]
    assert evaluation["pooled"]["mse"]["model"]["sway"] == pytest.approx(
        comparison["logs"][1]["scores"]["milliampere@1"]["mse"]["sway"], rel=1e-9
    )
    # The wind basis joins, as the log has an anemometer.
    terms = {row["term"] for row in comparison["coefficients"]["terms"]}
    assert len(terms) == 21 + 3 + 1
    page = Path(comparison["report"]).read_text(encoding="utf-8")
    assert page.count("<svg") == 2 + 2 * 2
    assert needs_nothing(page)
    conforms((Path(comparison["report"]).parent / "compare.json").read_text(encoding="utf-8"))
    alone = conforms(ferryid("compare", "milliampere@1", "milliampere@2", "--out", out, "--json", "-").out)
    assert alone["logs"] == []
    assert alone["coefficients"] == comparison["coefficients"]

    models = conforms(ferryid("models", "--out", out, "--json", "-").out)["models"]
    assert [model["version"] for model in models] == [1, 2]
    assert sum(model["current"] for model in models) == 1
    conforms(ferryid("models", "milliampere@1", "--out", out, "--json", "-").out)


def test_the_logs_of_a_comparison_are_given_in_several_ways(
    ferryid, fixtures: Path, fitted: tuple[Path, Run], compared: Run, tmp_path: Path
) -> None:
    log, other, (out, _) = fixtures / "short.mcap", fixtures / "second.bag", fitted
    models, comparison = ("compare", "milliampere@1", "milliampere@2"), conforms(compared.out)
    again = ferryid(*models, "--on", log, "--on", other, "--out", out, "--json", tmp_path / "again.json")
    assert conforms((tmp_path / "again.json").read_text(encoding="utf-8")) == comparison
    # A log of eighteen seconds, as the logs are what is looked at; the same trial as the first, whole, would be refused.
    cut = fixtures / "truncated.mcap"
    text = ferryid(*models, f"--on={cut}", other, "--out", out, "--json", tmp_path / "cut.json").out
    told = conforms((tmp_path / "cut.json").read_text(encoding="utf-8"))
    assert [entry["name"] for entry in told["logs"]] == ["truncated", "second"]
    twice = ferryid(*models, "--on", log, cut, "--out", out)
    assert twice.code == 2
    assert "truncated.mcap: holds the recording of" in twice.err
    for printed, report in ((again.out, comparison["report"]), (text, told["report"])):
        assert f"report  {report}" in printed
    assert "warning: milliampere@1 was trained on this log: its scores here are no evidence" in again.out


@pytest.mark.draws
@pytest.mark.parametrize(("what", "windows"), [("components", 1), ("window", 8), ("both", 2)])
def test_sweep_settings(ferryid, fixtures: Path, tmp_path: Path, what: str, windows: int) -> None:
    logs = [fixtures / "short.mcap", fixtures / "second.bag"]
    options = ("--windows", "0.5,1") if what == "both" else ()
    run = ferryid("sweep", what, *logs, "--vessel", "milliampere", *SCALE, *options, "--out", tmp_path, "--json", "-")
    assert run.code == 0, run.err
    found = conforms(run.out)
    assert set(found["by"]) == {"blocks", "logs"}
    assert found["estimator"]["asked"] == "auto"
    assert found["estimator"]["says"].startswith("Estimator auto: the derivative's was swept, ")
    assert len(found["windows_s"]) == windows
    for one in found["by"].values():
        tables = [*one["mse"].values(), *one["standard_error"].values(), one["score"], one["score_standard_error"]]
        assert {(len(table), len(row)) for table in tables for row in table} == {(windows, len(found["components"]))}
        assert one["choice"]["window_s"] in found["windows_s"]
    assert found["choice"] == found["by"]["blocks"]["choice"]
    page = Path(found["report"])
    assert conforms((page.parent / "sweep.json").read_text(encoding="utf-8")) == found
    text = page.read_text(encoding="utf-8")
    assert text.count("<svg") == len(list(page.parent.glob("*.svg"))) == 2
    assert needs_nothing(text)


@pytest.mark.draws
def test_sweep_structures(ferryid, fixtures: Path, tmp_path: Path) -> None:
    logs = [fixtures / "short.mcap", fixtures / "second.bag"]
    run = ferryid("sweep", "basis", *logs, "--vessel", "milliampere", *SCALE, "--out", tmp_path, "--json", "-")
    assert run.code == 0, run.err
    found = conforms(run.out)
    for one in found["by"].values():
        assert len({(each["basis"], each["structure"]) for each in one["structures"]}) == 2 * len(basis_names())
        scores = [each["score"] for each in one["structures"]]
        assert scores == pytest.approx(sorted(scores), rel=1e-9)
    page = Path(found["report"])
    assert conforms((page.parent / "sweep.json").read_text(encoding="utf-8")) == found
    assert page.read_text(encoding="utf-8").count("<svg") == len(list(page.parent.glob("*.svg"))) == 2


def test_fit_takes_the_window_that_it_is_told_to_choose(ferryid, fixtures: Path, tmp_path: Path) -> None:
    run = ferryid(
        "fit", fixtures / "short.mcap", "--vessel", "milliampere", *SCALE, "--window", "auto", "--no-report",
        "--out", tmp_path, "--json", tmp_path / "fit.json",
    )  # fmt: skip
    assert run.code == 0, run.err
    settings = conforms((tmp_path / "fit.json").read_text(encoding="utf-8"))["settings"]
    assert settings["window_s"] in settings["windows_s"]
    count = settings["components"]
    assert isinstance(count, int)
    # What was chosen is told, not left to the JSON.
    told = (
        f"{settings['basis']}, decoupled, {count} component{'s' if count > 1 else ''}, window {settings['window_s']} s"
    )
    assert f"fitted with basis {told}, coefficients from all rows\n" in run.out


@pytest.mark.draws
def test_diagnose_one_log_and_two(ferryid, fixtures: Path, tmp_path: Path) -> None:
    log, other = fixtures / "short.mcap", fixtures / "short.bag"
    run = ferryid("diagnose", log, "--vessel", "milliampere", "--out", tmp_path, "--json", "-")
    assert run.code == 0, run.err
    one = conforms(run.out)
    conforms((Path(one["report"]).parent / "diagnosis.json").read_text(encoding="utf-8"))
    page = Path(one["report"]).read_text(encoding="utf-8")
    assert needs_nothing(page)

    run = ferryid("diagnose", log, other, "--vessel", "milliampere", "--out", tmp_path, "--json", tmp_path / "two.json")
    assert run.code == 0, run.err
    both = conforms((tmp_path / "two.json").read_text(encoding="utf-8"))
    # The same recording in another format is left out.
    assert both["verdict"] == one["verdict"]
    said = " ".join(run.out.split())
    assert "1 further log is a copy and left out of the estimate: short.bag (of short.mcap)" in said

    found = ferryid("diagnose", log, "--out", tmp_path)
    assert found.code == 0
    assert found.err.startswith("vessel milliampere: bundled, the only profile")


@pytest.mark.usefixtures("batch_here")
def test_batch(ferryid, fixtures: Path, tmp_path: Path) -> None:
    options = ("--vessel", "milliampere", "--out", tmp_path / "out", "--json", "-")
    run = ferryid("batch", fixtures / "sh*.mcap", fixtures / "truncated.bag", fixtures / "README.md", *options)
    assert run.code == 0, run.err
    result = conforms(run.out)
    assert [row["status"] for row in result["rows"]] == ["done", "partly", "refused"]
    assert len(run.err.splitlines()) == 2, run.err
    for row in result["rows"]:
        for step, kind in (("fit", "fit"), ("diagnose", "diagnosis")):
            if row[step]:
                report = Path(result["folder"]) / row["folder"] / row[step]["report"]
                conforms(report.with_name(f"{kind}.json").read_text(encoding="utf-8"))
    page = Path(result["page"])
    links = [unquote(link) for link in re.findall(r'<a [^>]*href="([^"#]+)"', page.read_text(encoding="utf-8"))]
    assert len(links) == 1 + 3 + 2
    assert all((page.parent / link).is_file() for link in links)
    assert ferryid("batch", fixtures / "README.md", *options[:-2]).code == 2, "of nothing came anything"


def test_two_fits_of_one_log_are_the_same_file(ferryid, fixtures: Path, tmp_path: Path) -> None:
    texts = []
    for name in ("a", "b"):
        run = ferryid(
            "fit",
            fixtures / "short.mcap",
            "--vessel",
            "milliampere",
            *SCALE,
            *THESIS,
            "--no-report",
            "--out",
            tmp_path / name,
            "--json",
            "-",
        )
        model = Path(json.loads(run.out)["model"]["path"]).read_text(encoding="utf-8")
        texts.append("\n".join(line for line in model.splitlines() if '"created"' not in line))
    assert texts[0] == texts[1]


def test_simulate_and_list(ferryid, tmp_path: Path) -> None:
    scenario = ROOT / "fixtures" / "short.toml"
    run = ferryid("simulate", scenario, "--out", tmp_path, "--json", "-")
    assert run.code == 0, run.err
    assert conforms(run.out)["log"] == str(tmp_path / "short.mcap")
    assert (tmp_path / "short.mcap").read_bytes().startswith(b"\x89MCAP")
    assert ferryid("simulate", scenario, "--log", tmp_path / "t.bag").code == 0
    assert (tmp_path / "t.bag").read_bytes().startswith(b"#ROSBAG")
    old = ferryid("simulate", scenario, "--out", tmp_path / "old.bag")
    assert old.code == 2
    assert f"Fix: use --log {tmp_path / 'old.bag'} (" in old.err
    assert not (tmp_path / "old.bag").exists()
    assert "twelve-corner" in ferryid("simulate", "--list").out
    scenarios = conforms(ferryid("simulate", "--list", "--json", "-").out)["scenarios"]
    assert "twelve-corner" in {one["name"] for one in scenarios}


def test_reproduce_one_study(ferryid, tmp_path: Path) -> None:
    run = ferryid(
        "reproduce",
        "thesis",
        "--only",
        "guidance",
        "--seeds",
        "1",
        "--processes",
        "1",
        "--out",
        tmp_path,
        "--json",
        "-",
    )
    assert run.code == 0, run.err
    result = conforms(run.out)
    page = (tmp_path / "thesis.md").read_text(encoding="utf-8")
    assert [study["name"] for study in result["studies"]] == ["guidance"]
    shown = re.findall(r"\(thesis/([^)]+[.]svg)\)", page)
    assert shown
    assert shown == [figure["file"] for figure in result["studies"][0]["figures"]]
    assert sorted(shown) == sorted(path.name for path in (tmp_path / "thesis").iterdir())
    refused = ferryid("reproduce", "thesis", "--only", "clam", "--out", tmp_path)
    assert refused.code == 2
    assert 'Did you mean "calm"' in refused.err


def test_vessel_check_show_and_list(ferryid, tmp_path: Path) -> None:
    assert "milliampere" in ferryid("vessel", "list").out
    vessels = conforms(ferryid("vessel", "list", "--json", "-").out)["vessels"]
    assert {"milliampere", "gunnerus"} <= {one["name"] for one in vessels}
    assert ferryid("vessel", "show", "milliampere").code == 0
    copy = tmp_path / "copy.toml"
    copy.write_text(ferryid("vessel", "show", "milliampere", "--toml").out, encoding="utf-8")
    assert ferryid("vessel", "check", copy).out == f"{copy}: no faults\n"
    assert copy.read_bytes() == (ROOT / "ferryid" / "vessel" / "profiles" / "milliampere.toml").read_bytes()
    assert ferryid("vessel", "check", "milliampere").code == 0
    wrong = tmp_path / "boat.toml"
    wrong.write_text('schema = "ferryid.vessel/1"\nname = "boat"\n[hull]\nmass_kg = -3\n', encoding="utf-8")
    run = ferryid("vessel", "check", wrong, "--json", "-")
    assert run.code == 2
    assert any(fault["line"] == 4 for fault in conforms(run.out)["faults"])


def test_require_accept_exits_with_3(ferryid, tmp_path: Path) -> None:
    # Where nothing but noise comes on top of it, the true model cannot be improved by 5 %.
    log = tmp_path / "calm.mcap"
    assert ferryid("simulate", "twelve-corner-calm", "--log", log).code == 0
    run = ferryid("fit", log, "--vessel", "milliampere", "--out", tmp_path, "--require-accept", "--no-report")
    assert run.code == 3
    assert "Not accepted" in run.out
    assert "rejected" in ferryid("models", "--out", tmp_path).out


def test_version(ferryid) -> None:
    assert ferryid("--version").out.startswith("ferryid 0.")
