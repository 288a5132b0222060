"""The logs that a fit starts from: their order, and which of several are left out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ferryid.errors import ContradictionError, FerryIdError
from ferryid.identify import inputs
from ferryid.identify.pipeline import fit_logs
from ferryid.identify.settings import FitSettings
from ferryid.identify.sweeps.settings_sweep import sweep_settings
from ferryid.identify.sweeps.structure_sweep import sweep_structures
from ferryid.ingest.log import Loss
from ferryid.signals.copies import GivenLogs
from ferryid.signals.prepare import Opened, open_track
from ferryid.signals.smooth import Measured
from ferryid.types import RunContext
from ferryid.vessel import load_profile
from tests.identify.rounds import PROFILE, recorded_as
from tests.identify.trials import measured
from tests.ingest.bags import cut

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
NOWHERE = RunContext(Path("nowhere"))
QUICK = FitSettings(draws=1)
DAY_NS = 86_400 * 10**9
IN_1980_NS = 315_964_800 * 10**9
IN_2026_NS = 1_780_000_000 * 10**9


@pytest.mark.parametrize(
    ("begins", "given", "read"),
    [
        ({"a": IN_2026_NS, "b": IN_2026_NS + DAY_NS, "c": IN_2026_NS + 2 * DAY_NS}, "bca", "abc"),
        ({"a": IN_2026_NS, "b": IN_2026_NS + DAY_NS, "c": IN_2026_NS + 2 * DAY_NS}, "cab", "abc"),
        # Logs of a simulator begin at once, and a clock that was not set begins at zero.
        ({"a": IN_2026_NS, "b": IN_2026_NS, "c": IN_2026_NS}, "bca", "bca"),
        ({"a": IN_2026_NS, "b": IN_1980_NS, "c": IN_2026_NS + DAY_NS}, "cba", "cba"),
        ({"a": IN_2026_NS, "b": 0, "c": IN_2026_NS + DAY_NS}, "cba", "cba"),
    ],
    ids=["in 2026", "in another order", "at once", "clock of GPS not set", "no date"],
)
def test_logs_are_read_into_order_of_time(
    monkeypatch: pytest.MonkeyPatch, begins: dict[str, int], given: str, read: str
) -> None:
    def opened(path: str, *_: object, **__: object) -> SimpleNamespace:
        return SimpleNamespace(path=path, recording=SimpleNamespace(start_ns=begins[path]))

    monkeypatch.setattr(inputs, "open_track", opened)
    monkeypatch.setattr(GivenLogs, "add", lambda *_: None)
    found = inputs.read_logs(list(given), load_profile("milliampere"), FitSettings(), RunContext(Path("nowhere")))
    assert "".join(one.path for one in found) == read  # type: ignore[attr-defined]


Given = Callable[[Mapping[str, Measured | None]], list[str]]


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Opened:
    return open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path_factory.mktemp("out"))


@pytest.fixture
def given(opened: Opened, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Given:
    """What makes files that hold logs made in memory, None one that cannot be read, and returns their paths."""

    def files(logs: Mapping[str, Measured | None]) -> list[str]:
        def read(path: str, *_: object, **__: object) -> Opened:
            name = Path(path).stem
            made = logs.get(name)
            if name.startswith("contrary"):
                raise ContradictionError(f"{name}: signals contradict each other. Fix: turn one")
            if made is None:
                raise FerryIdError(f"{name}: no velocity. Fix: map it")
            return replace(
                opened,
                recording=recorded_as(opened.recording, name),
                measured=replace(made, log=name),
                track=opened.track,
            )

        monkeypatch.setattr(inputs, "open_track", read)
        paths = [tmp_path / f"{name}.log" for name in logs]
        for path in paths:
            path.touch()
        return [str(path) for path in paths]

    return files


def sound(seed: int) -> Measured:
    return measured(seed, jitter=0.03, noise=20.0)


def adrift(seed: int) -> Measured:
    """Return a log of a vessel that moves whatever its actuators were ordered."""
    log = sound(seed)
    other = np.random.default_rng(seed).standard_normal((len(log.t) // 20 + 1, 3)).repeat(20, axis=0)[: len(log.t)]
    return replace(log, tau=300.0 * other)


def brief() -> Measured:
    return measured(9, seconds=0.5)


def test_a_fit_leaves_out_which_of_several_logs_cannot_be_used(given: Given) -> None:
    paths = given({"one": sound(1), "foreign": None, "two": sound(2), "brief": brief()})
    found = fit_logs(paths, PROFILE, QUICK, NOWHERE)
    assert [log["name"] for log in found.model.training] == ["one", "two"]
    left_out = [one for one in found.warnings if one.startswith("Left out of the fit: ")]
    assert left_out == [
        "Left out of the fit: foreign: no velocity. Fix: map it",
        "Left out of the fit: brief: log shorter than the smoothing window, found 0.50 s unbroken where 1.10 s are needed. "
        "Fix: use a longer log or a shorter --window",
    ]


def test_one_log_that_cannot_be_used_is_refused_as_it_is(given: Given) -> None:
    with pytest.raises(FerryIdError, match=r"^foreign: no velocity\. Fix: map it$"):
        fit_logs(given({"foreign": None}), PROFILE, QUICK, NOWHERE)
    with pytest.raises(FerryIdError, match=r"^foreign: no velocity"):
        fit_logs(given({"foreign": None, "brief": brief()}), PROFILE, QUICK, NOWHERE)


def test_mistakes_in_the_arguments_are_never_left_out(given: Given) -> None:
    paths = given({"one": sound(1), "two": sound(2)})
    with pytest.raises(FerryIdError, match="absent: no velocity"):
        fit_logs([*paths, "absent"], PROFILE, QUICK, NOWHERE)
    with pytest.raises(FerryIdError, match="given twice"):
        fit_logs([*paths, paths[0]], PROFILE, QUICK, NOWHERE)
    with pytest.raises(FerryIdError, match="--components"):
        fit_logs(paths, PROFILE, replace(QUICK, components=99), NOWHERE)


def test_signals_that_contradict_each_other_in_half_of_the_logs_are_the_profiles_fault(given: Given) -> None:
    few = {"one": sound(1), "contrary": None, "two": sound(2)}
    (why,) = inputs.usable_logs(given(few), PROFILE, QUICK, NOWHERE).left_out
    assert why == "Left out of the fit: contrary: signals contradict each other. Fix: turn one"
    with pytest.raises(ContradictionError, match="contrary: signals contradict each other"):
        inputs.usable_logs(given({**few, "contrary 2": None}), PROFILE, QUICK, NOWHERE)


def test_too_little_that_is_left_is_refused_with_what_was_left_out(given: Given) -> None:
    paths = given({"one": measured(1, seconds=20.0), "foreign": None, "other": None})
    with pytest.raises(
        FerryIdError,
        match=r"^one: too short for three blocks .* are needed\. Left out of the fit: foreign: no velocity\. "
        r"So is 1 more log\. Fix: give a longer log",
    ):
        fit_logs(paths, PROFILE, QUICK, NOWHERE)


def test_a_log_that_was_cut_off_and_is_too_short_for_it_says_so(given: Given, monkeypatch: pytest.MonkeyPatch) -> None:
    (path,) = given({"one": measured(1, seconds=20.0)})
    read = inputs.open_track

    def cut_off(log: str, *others: Any, **more: Any) -> Opened:
        found = read(log, *others, **more)
        lost = Loss("one.bag", "the file ends at byte 9 of more than 18: about 50 % is lost at the end", start_ns=5)
        return replace(found, recording=replace(found.recording, losses=(lost,)))

    monkeypatch.setattr(inputs, "open_track", cut_off)
    with pytest.raises(
        FerryIdError,
        match=r"^one: too short .* are needed\. Messages may be lost: one\.bag: the file ends at byte 9 .* Fix: give a longer",
    ):
        fit_logs([path], PROFILE, QUICK, NOWHERE)


def test_a_log_whose_actuators_were_not_engaged_is_left_out(given: Given) -> None:
    paths = given({"one": sound(1), "adrift": adrift(3), "two": sound(2)})
    found = inputs.usable_logs(paths, PROFILE, QUICK, NOWHERE)
    assert [one.recording.name for one in found.opened] == ["one", "two"]
    (why,) = found.left_out
    assert "adrift.log: the applied forces accelerate the vessel by surge " in why
    assert "the actuators were not engaged" in why
    assert "In other logs the vessel follows them. Fix: " in why
    # The derivative's estimator does not ask.
    assert not inputs.usable_logs(paths, PROFILE, replace(QUICK, estimator="derivative"), NOWHERE).left_out


def test_a_log_that_does_not_show_whether_its_actuators_were_engaged_stays(given: Given) -> None:
    unknown = replace(adrift(3), tau=adrift(3).tau * [0.0, 0.0, 1.0])
    short = replace(
        adrift(4), **{name: getattr(adrift(4), name)[:150] for name in ("t", "eta", "nu", "tau", "usable", "tau_d")}
    )
    found = inputs.usable_logs(given({"one": sound(1), "unknown": unknown, "short": short}), PROFILE, QUICK, NOWHERE)
    assert not found.left_out


def test_logs_most_of_which_show_the_same_are_the_profiles_fault(given: Given) -> None:
    paths = given({"one": sound(1), "adrift": adrift(3), "drifting": adrift(8)})
    assert not inputs.usable_logs(paths, PROFILE, QUICK, NOWHERE).left_out
    assert not inputs.usable_logs(paths[1:], PROFILE, QUICK, NOWHERE).left_out


def test_a_log_whose_forces_are_reversed_is_not_taken_for_one_without_engaged_actuators(given: Given) -> None:
    turned = replace(sound(3), tau=-sound(3).tau)
    assert not inputs.usable_logs(given({"one": sound(1), "turned": turned}), PROFILE, QUICK, NOWHERE).left_out


def test_bags_that_follow_each_other_are_read_as_one_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ferry, run = load_profile("milliampere"), RunContext(tmp_path / "out")
    bags = cut(FIXTURES / "short.mcap", 4, folder=tmp_path)
    found = inputs.usable_logs(bags, ferry, QUICK, run)
    (one,) = found.opened
    assert one.recording.files == tuple(bags)
    assert found.notes == ("4 logs that follow each other without a break were joined into 1 log of 1.33 min.",)
    # Seconds count from the start of each log as it was given.
    some = replace(run, ranges=((2.0, 18.0),))
    assert len(inputs.usable_logs(bags, ferry, QUICK, some).opened) == 4
    read = inputs.open_track

    def refused(path: str, *others: Any, **more: Any) -> Opened:
        if bags[1] in path:
            raise FerryIdError(f"{bags[1]}: cannot be used")
        return read(path, *others, **more)

    monkeypatch.setattr(inputs, "open_track", refused)
    found = inputs.usable_logs(bags, ferry, QUICK, run)
    assert [one.recording.files for one in found.opened] == [(bags[0],), (bags[2],), (bags[3],)]
    assert bags[1] in found.left_out[0]
    assert not found.notes


@pytest.mark.slow
def test_sweeps_leave_out_the_same_logs(given: Given) -> None:
    paths = given({"one": sound(1), "foreign": None, "adrift": adrift(3), "two": sound(2)})
    settings = replace(QUICK, estimator="weak")
    for found in (
        sweep_settings("components", paths, PROFILE, settings, NOWHERE),
        sweep_structures(paths, PROFILE, settings, NOWHERE),
    ):
        assert [log["name"] for log in found.logs] == ["one", "two"]
        assert [note.split(":")[0] for note in found.notes[-2:]] == ["Left out of the sweep"] * 2

    def odd(asked: Sequence[str]) -> tuple[Mapping[str, str], tuple[str, ...]]:
        return {paths[4]: "no common hull fits it. Fix: fit it by itself"}, ("One may be another's.",)

    paths = given({"one": sound(1), "foreign": None, "adrift": adrift(3), "two": sound(2), "three": sound(3)})
    for found in (
        sweep_settings("components", paths, PROFILE, settings, NOWHERE, odd=odd),
        sweep_structures(paths, PROFILE, settings, NOWHERE, odd=odd),
    ):
        assert [log["name"] for log in found.logs] == ["one", "two"]
        assert "One may be another's." in found.notes
        assert f"Left out of the sweep: {paths[4]}: no common hull fits it. Fix: fit it by itself" in found.notes


def test_logs_of_another_vessel_are_left_out_with_what_is_said_of_them(given: Given) -> None:
    paths = given({"one": sound(1), "foreign": None, "other": sound(3), "two": sound(2)})

    def odd(asked: Sequence[str]) -> tuple[Mapping[str, str], tuple[str, ...]]:
        assert list(asked) == [paths[0], *paths[2:]]
        return {paths[2]: "no common hull fits it. Fix: fit it by itself"}, ("One may be another's.",)

    found = fit_logs(paths, PROFILE, QUICK, NOWHERE, odd=odd)
    assert [log.motion.log for log in found.logs] == ["one", "two"]
    said = f"Left out of the fit: {paths[2]}: no common hull fits it. Fix: fit it by itself"
    assert list(found.logs_left_out) == [paths[1], paths[2]]
    assert found.logs_left_out[paths[2]] == said
    assert found.warnings[-3:] == ("One may be another's.", found.logs_left_out[paths[1]], said)
    # There is nothing to compare one log with.
    inputs.usable_logs(paths[:2], PROFILE, QUICK, NOWHERE, odd=odd)


@pytest.mark.slow
def test_an_unengaged_run_of_the_catamaran_is_left_out(shared_data: Callable[[str], Path], tmp_path: Path) -> None:
    logs = sorted(shared_data("vtec_usv").glob("*.bag")) + sorted(shared_data("vtec_usv/edge").glob("*.bag"))
    profile = load_profile("vtec-usv")
    found = inputs.usable_logs([str(log) for log in logs], profile, FitSettings().on(profile), RunContext(tmp_path))
    assert len(found.opened) == len(logs) - 2
    navigation, engaged = found.left_out
    assert "u_1_psi_ref_2021-08-16-15-07-44.bag: position is needed" in navigation
    assert "52000_2016-02-11-10-40-10.bag: the applied forces accelerate the vessel by surge 0.0" in engaged
