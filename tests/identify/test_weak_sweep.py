"""Settings of the weak form swept: finite scores, a choice among what was given, and what makes no sense refused."""

from __future__ import annotations

import html
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ferryid import api
from ferryid.errors import FerryIdError
from ferryid.identify import inputs
from ferryid.identify.log_windows import average_log
from ferryid.identify.pipeline import fit_opened
from ferryid.identify.settings import FitSettings
from ferryid.identify.sweeps import weak_sweep
from ferryid.identify.sweeps.settings_sweep import Sweep, sweep_json, sweep_settings
from ferryid.regression.bases import make_basis
from ferryid.report.sweep_report import render
from ferryid.report.sweep_text import render_sweep
from ferryid.signals.prepare import Opened, open_track
from ferryid.signals.smooth import Measured, smooth_measured
from ferryid.types import RunContext
from ferryid.vessel.profile import Profile
from tests.identify.rounds import PROFILE, recorded_as
from tests.identify.trials import measured

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
SETTINGS = FitSettings(delta=0.4, sigma=0.4, estimator="weak")
RUN = RunContext(Path("nowhere"))
Run = Callable[..., Sweep]


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Opened:
    return open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path_factory.mktemp("out"))


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> Run:
    """Return a function that sweeps logs made in memory."""

    def swept(
        what: str,
        logs: Sequence[Measured],
        settings: FitSettings = SETTINGS,
        profile: Profile = PROFILE,
        **options: Any,
    ) -> Sweep:
        ready = {
            log.log: replace(
                opened,
                measured=log,
                recording=recorded_as(opened.recording, log.log),
            )
            for log in logs
        }
        monkeypatch.setattr(inputs, "open_track", lambda path, *_, **__: ready[path])
        return sweep_settings(what, list(ready), profile, settings, RUN, **options)

    return swept


@pytest.mark.slow
def test_every_combination_has_a_finite_score_and_the_choice_is_one_of_them(run: Run) -> None:
    windows_s = (4.0, 8.0)
    both = run("both", [measured(1, noise=50.0, jitter=0.02)], windows_s=windows_s)
    curves = both.choice.curves
    assert both.windows_s == windows_s
    assert curves.mse.shape[:2] == (2, 18)
    assert np.isfinite(curves.mse).all()
    assert curves.folds == 5
    assert both.choice.window_s in windows_s
    assert (curves.mse[both.choice.window, both.choice.components - 1] < curves.base).all()
    one = run("components", [measured(1, noise=50.0, jitter=0.02)], replace(SETTINGS, weak_window_s=8.0))
    # The same test windows, whatever is tried beside.
    np.testing.assert_array_equal(one.choice.curves.mse[0], curves.mse[1])
    assert one.windows_s == (8.0,)
    window = run("window", [measured(1, noise=50.0, jitter=0.02)], replace(SETTINGS, components=9), windows_s=windows_s)
    assert window.choice.components == 9
    assert window.choice.window == int(np.argmin(curves.normalised()[0][:, 8]))


def test_an_axis_that_is_not_measured_is_not_judged(run: Run) -> None:
    signals = tuple(
        replace(one, fields=one.fields[:1], frame="FRD") if one.quantity == "velocity" else one
        for one in PROFILE.signals
    )
    surge = replace(PROFILE, signals=signals)
    assert not surge.measures_sway
    found = run("components", [measured(1, noise=50.0, seconds=300.0)], replace(SETTINGS, weak_window_s=8.0), surge)
    curves = found.choice.curves
    assert np.isfinite(curves.normalised()[0]).all()
    assert (curves.normalised()[0].min(axis=(0, 1)) >= 1.0).all()
    assert not curves.base[1]
    assert not curves.mse[..., 1].any()
    assert np.isnan(found.choice.over_base[..., 1]).all()
    (line,) = [one for one in render_sweep(found).splitlines() if one.startswith("* ")][:1]
    assert "nan" not in line
    assert "–" in line
    page = html.unescape(render(found)[0])
    assert not re.search(r"\bnan\b", page)


@pytest.mark.slow
def test_a_window_longer_than_the_manoeuvres_is_not_taken(run: Run) -> None:
    found = run("window", [measured(1, noise=50.0, seconds=500.0)], windows_s=(6.0, 30.0))
    assert found.choice.window_s == 6.0


@pytest.mark.slow
@pytest.mark.draws
def test_what_is_told(run: Run) -> None:
    days = [measured(seed, noise=20.0, seconds=120.0) for seed in (1, 2)]
    found = run("both", days, windows_s=(5.0, 8.0))
    assert list(found.by) == ["blocks", "logs"]
    plain = sweep_json(found, "page.html")
    assert plain["settings"]["estimator"] == "weak"
    assert plain["test_window_s"] == found.test_window_s == pytest.approx(8.0)
    assert plain["windows_s"] == [5.0, 8.0]
    assert plain["choice"]["window_s"] in (5.0, 8.0)
    assert plain["by"]["logs"]["folds"] == 2
    text = render_sweep(found)
    assert "Cross-validated squared prediction error over the base model's" in text
    assert "windows\n" in text
    page, drawings = render(found)
    assert "Every combination was fitted in the weak form" in page
    assert "window of the weak form [s]" in drawings["both-blocks"]
    assert "Only 2 folds by whole logs: their scatter, and so the choice, is rough." in found.notes


@pytest.mark.slow
def test_what_makes_no_sense_is_refused(run: Run, tmp_path: Path) -> None:
    log = measured(1, seconds=120.0)
    for what, settings, options, says in (
        ("components", SETTINGS, {"windows_s": (4.0,)}, "--windows: .*Fix: give --weak-window, or sweep both"),
        ("window", SETTINGS, {"windows_s": (0.1, 4.0)}, "--weak-window: 0.1 s is no window of the weak form. Fix: "),
        ("window", SETTINGS, {"windows_s": (8.0,)}, "nothing to compare, as only windows of 8 s .*Fix: "),
        (
            "window",
            SETTINGS,
            {"windows_s": (8.0, 60.0)},
            "needs 12 overlapping windows of 60 s .* in a fold. Fix: give shorter",
        ),
        (
            "components",
            replace(SETTINGS, weak_window_s=60.0),
            {},
            "needs 12 overlapping windows of 60 s .* in a fold. Fix: ",
        ),
        ("both", replace(SETTINGS, residual="commanded"), {}, "--residual commanded: the weak form .*Fix: "),
        ("both", SETTINGS, {"folds": 1}, "--folds: 1 .*Fix: "),
    ):
        with pytest.raises(FerryIdError, match=says) as error:
            run(what, [log], settings, **options)
        assert "\n" not in str(error.value)
    with pytest.raises(FerryIdError, match="--components: 50 are more than the 18 functions"):
        run("window", [log], replace(SETTINGS, components=50))
    with pytest.raises(FerryIdError, match=r"there is no estimator called 'week'.*weak"):
        FitSettings(estimator="week")


@pytest.mark.slow
def test_usual_lengths_that_do_not_fit_are_left_out_and_said(run: Run) -> None:
    found = run("window", [measured(1, seconds=100.0)], replace(SETTINGS, components=6))
    assert found.windows_s == (2.0, 4.0, 8.0)
    assert any(
        note.startswith("A window of 16 s was left out: the weak form needs 12 overlapping windows")
        for note in found.notes
    )


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "jitter", "estimator"), [(50.0, 0.0, "derivative"), (20.0, 0.15, "weak")])
def test_auto_sweeps_what_a_fit_uses(run: Run, opened: Opened, noise: float, jitter: float, estimator: str) -> None:
    log, settings = measured(1, noise=noise, jitter=jitter), replace(SETTINGS, estimator="auto")
    found = run("components", [log], settings)
    plain = sweep_json(found)
    fitted = fit_opened([replace(opened, measured=log)], PROFILE, replace(settings, draws=1), RUN, "fit")
    assert fitted.model.settings["estimator"] == estimator
    assert plain["estimator"]["asked"] == "auto"
    assert plain["estimator"]["swept"] == plain["settings"]["estimator"] == estimator
    assert plain["estimators"] == [one.to_json() for one in fitted.estimators]
    assert plain["fit_options"][:2] == ["--estimator", estimator]
    own = run("components", [log], replace(settings, estimator=estimator))
    np.testing.assert_array_equal(found.choice.curves.mse, own.choice.curves.mse)
    assert (own.estimator_says, own.estimators) == ("", ())
    line = plain["estimator"]["says"]
    assert line.startswith("Estimator auto: ")
    assert "which a fit uses" in line
    assert render_sweep(found).splitlines()[1:3] == [line, "Fit with: " + " ".join(plain["fit_options"])]
    told = render_sweep(found).splitlines()[3]
    assert told.startswith("Without them a fit may take others: it chooses on its training rows alone")
    assert line in html.unescape(render(found)[0])


@pytest.mark.parametrize(
    ("seconds", "jitter", "settings", "options", "says"),
    [
        (240.0, 0.15, {}, {"windows_s": (0.5, 1.0)}, "as --windows are its smoothing windows; --estimator weak takes"),
        (240.0, 0.15, {"residual": "commanded"}, {}, "as a fit uses it: the weak form explains the measured force"),
        (120.0, 0.15, {}, {}, "as a fit uses it: the weak form needs 12 overlapping windows of 8 s"),
        (30.0, 0.0, {}, {}, "as a fit cannot compare the two: .*too short for three blocks"),
    ],
)
def test_auto_says_why_it_sweeps_the_derivative(
    run: Run, seconds: float, jitter: float, settings: dict[str, Any], options: dict[str, Any], says: str
) -> None:
    log = measured(1, noise=20.0, jitter=jitter, seconds=seconds)
    found = run("both" if options else "components", [log], replace(SETTINGS, estimator="auto", **settings), **options)
    assert re.search(says, found.estimator_says)
    assert not found.weak
    assert found.windows_s == options.get("windows_s", (1.0,))


def test_auto_falls_back_where_folds_are_too_short(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    log = measured(1, noise=20.0, jitter=0.15)
    monkeypatch.setattr(weak_sweep, "_impossible", lambda *_: "too few windows")
    found = run("components", [log], replace(SETTINGS, estimator="auto"))
    assert found.settings.estimator == "derivative"
    assert "cannot be cross-validated: round 1: too few windows in a fold." in found.estimator_says
    with pytest.raises(FerryIdError, match=r"too few windows in a fold\. Fix: "):
        run("components", [log])


def test_folds_are_apart_and_hold_all_windows() -> None:
    logs = [
        average_log(
            PROFILE, SETTINGS, make_basis("modulus"), smooth_measured(measured(seed, seconds=s), 1.0), divided=False
        )
        for seed, s in ((1, 240.0), (2, 20.0), (3, 60.0))
    ]
    folds = weak_sweep.folds_by_stretches(logs, 5)
    tested = [[len(part.measured) for part in weak_sweep.tested_parts(logs, fold)] for fold in folds]
    assert min(one[0] for one in tested) > 3
    # A log too short for five stretches is tested whole, in one fold; the next begins in the fold after.
    assert [one[1] > 0 for one in tested] == [True, False, False, False, False]
    assert [one[2] > 0 for one in tested] == [False, True, True, True, False]
    for fold in folds:
        for log, test, train in zip(
            logs, weak_sweep.tested_parts(logs, fold), weak_sweep.trained_parts(logs, fold), strict=True
        ):
            if len(test.measured) and len(train.measured):
                apart = np.abs(test.measured.start[:, None] - train.measured.start[None, :])
                assert apart.min() >= log.length + log.purge_s * log.rate_hz - 1
    whole = weak_sweep.folds_by_logs(logs)
    assert len(whole) == 3
    for number, fold in enumerate(whole):
        assert [len(part.measured) > 0 for part in weak_sweep.tested_parts(logs, fold)] == [
            k == number for k in range(3)
        ]
        assert [len(part.measured) > 0 for part in weak_sweep.trained_parts(logs, fold)] == [
            k != number for k in range(3)
        ]


@pytest.mark.slow
def test_a_sweep_of_an_archive_is_that_of_the_logs(tmp_path: Path) -> None:
    log = str(FIXTURES / "short.mcap")
    open_track(log, PROFILE, tmp_path)
    settings = replace(SETTINGS, weak_window_s=4.0)
    by_logs = sweep_settings("components", [log], PROFILE, settings, RunContext(tmp_path))
    by_archive = sweep_settings("components", [], PROFILE, settings, RunContext(tmp_path), archive=True)
    np.testing.assert_allclose(by_archive.choice.curves.mse, by_logs.choice.curves.mse, rtol=1e-9)
    assert by_archive.logs == by_logs.logs
    report = api.sweep("components", [], PROFILE, settings, tmp_path, archive=True)
    assert report.json["choice"]["components"] == by_logs.choice.components
    # As a fit to an archive.
    auto = sweep_settings(
        "components", [], PROFILE, replace(settings, estimator="auto"), RunContext(tmp_path), archive=True
    )
    assert not auto.weak
    assert "as a fit to an archive uses it; --estimator weak sweeps the weak form." in auto.estimator_says
