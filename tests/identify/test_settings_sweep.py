"""The sweep as a whole: what it tells, what it notes, and what it refuses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.identify import inputs
from ferryid.identify.settings import FitSettings
from ferryid.identify.sweeps.settings_sweep import Sweep, sweep_json, sweep_settings
from ferryid.identify.sweeps.swept import beats_base
from ferryid.report.sweep_text import headline, render_sweep
from ferryid.signals.copies import GivenLogs
from ferryid.signals.prepare import Opened, open_track
from ferryid.signals.smooth import Measured
from ferryid.types import RunContext
from tests.identify.rounds import PROFILE, recorded_as
from tests.identify.trials import measured

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
SETTINGS = FitSettings(delta=0.4, sigma=0.4, estimator="derivative")
Run = Callable[..., Sweep]


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Opened:
    return open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path_factory.mktemp("out"))


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> Run:
    """Return a function that sweeps logs made in memory."""

    def swept(what: str, logs: Sequence[Measured], settings: FitSettings = SETTINGS, **options: object) -> Sweep:
        ready = {
            log.log: replace(
                opened,
                measured=log,
                recording=recorded_as(opened.recording, log.log),
            )
            for log in logs
        }
        monkeypatch.setattr(inputs, "open_track", lambda path, *_, **__: ready[path])
        return sweep_settings(what, list(ready), PROFILE, settings, RunContext(Path("nowhere")), **options)  # type: ignore[arg-type]

    return swept


@pytest.mark.slow
def test_both_is_every_window_of_components(run: Run) -> None:
    log, windows_s = measured(1, noise=50.0), (0.5, 1.0, 2.0)
    both = run("both", [log], windows_s=windows_s)
    assert both.windows_s == windows_s
    assert list(both.by) == ["blocks"]
    assert run("window", [log], windows_s=windows_s).choice.curves.mse.tolist() == both.choice.curves.mse.tolist()
    # At the longest window alone the same rows are purged.
    one = run("components", [log], replace(SETTINGS, window_s=2.0))
    np.testing.assert_array_equal(one.choice.curves.mse[0], both.choice.curves.mse[2])
    assert one.windows_s == (2.0,)


@pytest.mark.slow
def test_stretches_and_whole_logs_choose_apart(run: Run) -> None:
    """A steady load of each day's own can be learnt within that day and not from another."""
    days = [measured(seed, noise=5.0, force=lambda made, push=push: np.full((len(made.t), 3), push))
            for seed, push in ((1, 200.0), (2, -200.0), (3, 0.0))]  # fmt: skip
    found = run("components", days)
    assert list(found.by) == ["blocks", "logs"]
    assert (found.by["blocks"].curves.folds, found.by["logs"].curves.folds) == (5, 3)
    assert found.choice is found.by["blocks"]
    # What differs between days is no function of motion: by whole logs it is an error, 2 · 200²/3 N² and that of the mean.
    assert (found.by["logs"].curves.mse.min(axis=(0, 1)) > 2.0 * 200.0**2 / 3.0).all()


@pytest.mark.slow
def test_a_number_of_components_is_kept_to_where_windows_are_swept(run: Run) -> None:
    settings = replace(SETTINGS, components=4)
    assert run("window", [measured(1)], settings).choice.components == 4
    assert run("both", [measured(1)], settings).settings.components == "auto"


@pytest.mark.slow
def test_notes(run: Run) -> None:
    log = measured(1, noise=20.0)
    assert run("components", [log]).notes == ()
    forceless = [replace(measured(seed, noise=5.0), tau=measured(seed).tau * [1.0, 0.0, 1.0]) for seed in (1, 2)]
    notes = run("components", forceless).notes
    assert "By contiguous stretches of every log the base model's inertia was held in sway, as a fit does." in notes
    assert any("Only 2 folds by whole logs" in note for note in notes)
    still = [replace(one, tau=one.tau * 0.0) for one in forceless]
    assert any("was held in surge, sway and yaw, as" in note for note in run("components", still).notes)
    assert any("By whole logs the choice is" in note for note in notes) is (
        run("components", forceless).by["logs"].components != run("components", forceless).choice.components
    )
    assert any("Only 3 folds by contiguous" in note for note in run("components", [log], folds=3).notes)
    ends = run("both", [measured(1, jitter=0.05)], windows_s=(0.0, 0.2, 0.5))
    assert "The window chosen is the longest that was tried." in ends.notes
    commanded = run("components", [replace(log, tau_d=log.tau)], replace(SETTINGS, residual="commanded"))
    assert "Fitted to the commanded residual, tested against measured force." in commanded.notes


@pytest.mark.slow
def test_a_sweep_that_loses_to_the_base_model_recommends_none(run: Run) -> None:
    """Where the base model is true, every correction only adds noise."""
    found = run("components", [measured(3, seconds=300.0, noise=200.0)], FitSettings(estimator="derivative"))
    assert not found.any_beats_base
    assert not sweep_json(found)["beats_base"]
    told = render_sweep(found)
    assert told.startswith("No setting beats the base model: keep it as it is. Choice, were it fitted all the same:")
    assert "\nTo fit all the same: --estimator" in told
    wrong = run("components", [measured(3, noise=5.0)])
    assert wrong.choice_beats_base
    assert sweep_json(wrong)["beats_base"]
    assert render_sweep(wrong).startswith("Choice: ")


@pytest.mark.parametrize(
    ("ratios", "beats"),
    [
        ([0.9, 1.05, 1.0], True),
        ([1.2, 0.9, 1.0], False),
        ([np.nan, 0.9, 1.0], True),
        ([np.nan, np.nan, 1.0], False),
        ([np.nan] * 3, False),
    ],
)
def test_the_base_model_is_beaten_on_average_over_the_axes_on_which_it_errs(ratios: list[float], beats: bool) -> None:
    assert beats_base(np.array(ratios)) == beats


def test_what_is_told_is_what_was_found(run: Run) -> None:
    found = run("both", [measured(1, noise=50.0)], windows_s=(0.5, 1.0, 2.0))
    plain = sweep_json(found, "page.html")
    choice = plain["choice"]
    one = plain["by"]["blocks"]
    place = plain["windows_s"].index(choice["window_s"]), plain["components"].index(choice["components"])
    ratio = one["mse"]["sway"][place[0]][place[1]] / one["base_mse"]["sway"]
    assert f"sway {ratio:.3g}" in headline(found)
    assert headline(found).startswith(
        f"Choice: {choice['components']} components at a window of {choice['window_s']:g} s."
    )
    # Of all that cannot be told from the least, none has fewer components.
    score, near = np.array(one["score"]), found.choice.curves.near()
    assert near[place]
    assert not near[:, : place[1]].any()
    lines = render_sweep(found).splitlines()
    row = next(line for line in lines if line.split()[:1] == [str(choice["components"])])
    assert f"{score[place]:.4f}*" in row
    assert sum(line.count("*") for line in lines if "within" not in line) == 1
    cells = np.array(
        [[float(cell.rstrip("*·")) for cell in line.split()[1:]] for line in lines if line.strip()[:1].isdigit()]
    )
    np.testing.assert_allclose(cells, score.T, atol=6e-5)
    assert sum(line.count("·") for line in lines if "within" not in line) == near.sum() - 1


@pytest.mark.parametrize("what", ["components", "window"])
def test_a_table_has_a_line_for_each_setting(run: Run, what: str) -> None:
    found = run(what, [measured(1, noise=50.0)])
    lines = render_sweep(found).splitlines()
    starred = [line for line in lines if line.startswith("* ")]
    assert len(starred) == 1
    wanted = f"{found.choice.window_s:g}" if what == "window" else str(found.choice.components)
    cells = starred[0].split()
    assert cells[1] == wanted
    place = found.choice.window, found.choice.components - 1
    score = found.choice.curves.normalised()[0][place]
    assert f"{found.choice.over_base[place][2]:.4g} {score:.4f}" in " ".join(cells)
    table = [line for line in lines if line[:2] in ("  ", "* ")]
    assert len(table) == 2 + (len(found.windows_s) if what == "window" else found.choice.curves.mse.shape[1])


@pytest.mark.parametrize(
    ("what", "options", "told"),
    [
        ("windows", {}, r'nothing called "windows" to sweep\. Did you mean "window"\?'),
        ("components", {"windows_s": (1.0, 2.0)}, "--windows: components are swept at one window"),
        ("components", {"folds": 1}, "--folds: 1 is no number of folds"),
        ("components", {"folds": 21}, "--folds: 21 is no number of folds"),
        ("window", {"windows_s": (1.0,)}, "round 1: nothing to compare, as every window given is 1 s"),
        (
            "both",
            {"windows_s": (1.0, 1.05)},
            "nothing to compare, as every window given is 1 s, rounded to samples of this log",
        ),
        ("both", {"windows_s": (1.0, -1.0)}, "-1.0 s is no smoothing window"),
        ("both", {"windows_s": (1.0, 59.0)}, "round 1: log shorter than the smoothing window"),
    ],
)
def test_what_cannot_be_swept(run: Run, what: str, options: dict[str, object], told: str) -> None:
    with pytest.raises(FerryIdError, match=rf"{told}.*Fix: [^\n]+$"):
        run(what, [measured(1, seconds=50.0)], **options)


def test_a_log_given_twice_is_refused(run: Run, opened: Opened, monkeypatch: pytest.MonkeyPatch) -> None:
    again = replace(opened, recording=replace(opened.recording, files=("other.mcap",)))
    both = {"a": opened, "b": again}
    monkeypatch.setattr(inputs, "open_track", lambda path, *_, **__: both[path])
    with pytest.raises(FerryIdError, match=r"other\.mcap: the same log as"):
        sweep_settings("components", ["a", "b"], PROFILE, SETTINGS, RunContext(Path("nowhere")))


def test_a_part_of_two_logs_is_refused() -> None:
    part, whole = (
        SimpleNamespace(sha256=name, files=files, streams={})
        for name, files in (("1", ("a.bag",)), ("2", ("b.bag", "./a.bag")))
    )
    given = GivenLogs()
    given.add(part)  # type: ignore[arg-type]
    with pytest.raises(FerryIdError, match=r"a\.bag: is part of two logs.*Fix: "):
        given.add(whole)  # type: ignore[arg-type]


def test_the_options_for_a_fit_hold_what_is_not_usual(run: Run) -> None:
    settings = replace(SETTINGS, structure="coupled", delta=0.9)
    found = run("components", [measured(1, seconds=50.0)], settings)
    options = dict(zip(found.fit_options[::2], found.fit_options[1::2], strict=True))
    assert options["--structure"] == "coupled"
    assert options["--delta"] == "0.9"
    assert options["--sigma"] == "0.4"
    assert not {"--basis", "--zeta", "--smoother", "--inertia", "--rate"} & set(options)
