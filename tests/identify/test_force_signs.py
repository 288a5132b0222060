"""Forces that act the wrong way round: named where logs show it, left open where they do not, not read into sound logs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.identify.excitation import still_axes
from ferryid.identify.force_signs import force_response, refuse_reversed_forces
from ferryid.identify.inputs import read_logs
from ferryid.identify.motion_data import LogData, compute_residuals
from ferryid.identify.pipeline import fit_logs, fit_opened
from ferryid.identify.settings import FitSettings
from ferryid.signals.prepare import Opened, open_track, smoothed
from ferryid.signals.smooth import Measured
from ferryid.types import RunContext
from ferryid.vessel import load_profile, parse_profile
from ferryid.vessel.profile import Profile
from tests.identify.rounds import PROFILE
from tests.identify.trials import measured

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
TURNED = (1.0, 1.0, -1.0)
VTEC = {
    "48000_2016-02-11-10-52-07": True,
    "52000_2016-02-11-10-40-10": False,
    "exp37_1_2016-02-11-10-41-20": True,
    "exp38_1_2016-02-11-10-44-41": True,
    "exp39_1_2016-02-11-10-47-10": True,
    "exp42_1_2016-02-11-10-49-46": True,
    "exp48_1_2016-02-11-10-54-35": True,
    "exp50_1_2016-02-11-10-57-22": True,
    "exp50_v_2016-02-11-11-12-11": True,
    "exp52_v_2016-02-11-11-14-28": True,
}
"""Runs of the catamaran, and whether each shows by itself that its thrusters were exchanged."""
OTHERS = {
    "esso-osaka": "esso_osaka/*/*.csv",
    "kvlcc2-model": "kvlcc2/*_Z_*.dat",
    "gunnerus": "gunnerus/*.csv",
    "milliampere-2025": "milliampere1",
}
LINES = '[signals."left.force.command"] with [signals."right.force.command"]'
UNKNOWN = "These logs do not show whether the yaw moment acts the right way round: the vessel follows it by "
AGAINST = "The vessel turns against the yaw moment, by -0.0"


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Opened:
    return open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path_factory.mktemp("out"))


def data_of(opened: Opened, log: Measured, profile: Profile = PROFILE, **changes: object) -> LogData:
    settings = replace(FitSettings().on(profile), **changes)  # type: ignore[arg-type]
    return compute_residuals(profile, settings, [smoothed(replace(opened, measured=log), 1.0, "square")])


def recorded(logs: list[Path], profile: Profile, out: Path) -> LogData:
    settings = FitSettings().on(profile)
    every = read_logs([str(log) for log in logs], profile, settings, RunContext(out))
    data = compute_residuals(profile, settings, [smoothed(one, 1.0, "square") for one in every])
    return replace(data, functions=data.functions.without(still_axes(profile, data.motions)))


def exchanged() -> Profile:
    text = load_profile("vtec-usv").text.replace('"/left_thruster"', '"/other"')
    text = text.replace('"/right_thruster"', '"/left_thruster"').replace('"/other"', '"/right_thruster"')
    return parse_profile(text, "exchanged")


def turned(log: Measured) -> Measured:
    return replace(log, tau=log.tau * TURNED)


@pytest.mark.parametrize("seconds", [40.0, 240.0])
def test_a_reversed_moment_is_named(opened: Opened, seconds: float) -> None:
    log = measured(1, seconds=seconds, jitter=0.03, noise=20.0)
    assert refuse_reversed_forces(data_of(opened, log)) == ""
    settings, run = FitSettings(draws=1), RunContext(Path("nowhere"))
    for estimator in ("auto", "weak"):
        with pytest.raises(FerryIdError, match=r"the yaw moment accelerates the vessel in yaw by -.* exchanged"):
            fit_opened(
                [replace(opened, measured=turned(log))], PROFILE, replace(settings, estimator=estimator), run, "f"
            )


def test_a_refusal_says_what_else_is_wrong_with_the_log(opened: Opened) -> None:
    data = data_of(opened, turned(measured(1, seconds=240.0, jitter=0.03, noise=20.0)))
    with pytest.raises(FerryIdError, match=r"the yaw moment accelerates .*heading and yaw rate$"):
        refuse_reversed_forces(data)
    off = (
        "The vessel moves 176 deg to starboard of its heading, at all headings alike: if it moved ahead, add +176 deg."
    )
    doubted = tuple(replace(one, doubts=(off,)) for one in data.prepared)
    with pytest.raises(FerryIdError, match=r"yaw rate\. Mind first: .*: The vessel moves 176 deg .*add \+176 deg$"):
        refuse_reversed_forces(replace(data, prepared=doubted))


@pytest.mark.slow
def test_a_response_has_the_truth_in_its_interval(opened: Opened) -> None:
    off = []
    for seed in range(20):
        found = force_response(data_of(opened, measured(seed, seconds=120.0, jitter=0.02, noise=50.0)))
        assert found is not None
        assert np.isnan(found.reversed).all()
        off.append((found.response - 1.0) / found.spread)
    assert np.mean(np.abs(off) > 3.0) < 0.05


def without_a_moment(log: Measured) -> Measured:
    """Return a log with a moment that has nothing to do with the motion."""
    other = np.random.default_rng(3).standard_normal(len(log.t) // 20 + 1).repeat(20)[: len(log.t)]
    return replace(log, tau=np.column_stack([log.tau[:, :2], 300.0 * other]))


def test_a_log_too_short_to_fit_says_what_it_leaves_open_as_well(opened: Opened) -> None:
    short = without_a_moment(measured(1, seconds=36.0, jitter=0.03))
    with pytest.raises(
        FerryIdError, match=f"too short for three blocks .* are needed. {UNKNOWN}.*sides. Fix: give a longer"
    ):
        fit_opened([replace(opened, measured=short)], PROFILE, FitSettings(), RunContext(Path("nowhere")), "short")


def test_a_moment_that_is_too_large_and_reversed_is_not_said_to_be_unknown(opened: Opened) -> None:
    log = measured(1, seconds=240.0, jitter=0.03)
    told = refuse_reversed_forces(data_of(opened, replace(log, tau=log.tau * np.array([1.0, 1.0, -15.0]))))
    assert told.startswith(AGAINST)
    assert "Exchanged actuators or an angle of the wrong sign would do that" in told


def test_what_a_log_cannot_show_is_said_and_not_refused(opened: Opened) -> None:
    drowned = without_a_moment(measured(1, seconds=240.0, jitter=0.03))
    told = refuse_reversed_forces(data_of(opened, drowned))
    assert told.startswith(UNKNOWN)
    assert told.endswith(
        "and exchanged actuators or an angle of the wrong sign would look alike. Record turns to both sides."
    )
    fitted = fit_opened(
        [replace(opened, measured=drowned)], PROFILE, FitSettings(draws=1), RunContext(Path("nowhere")), "unknown"
    )
    assert told in fitted.warnings


def test_a_reversed_moment_that_no_inertia_explains_is_no_exchange(opened: Opened) -> None:
    log = measured(1, seconds=240.0, jitter=0.03)
    found = force_response(data_of(opened, replace(log, tau=log.tau * (1.0, 1.0, -0.5))))
    assert found is not None
    assert found.response[2] < -1.0
    assert found.possible.tolist() == [True, True, False]
    assert np.isnan(found.reversed).all()


def test_windows_that_are_too_few_show_nothing(opened: Opened) -> None:
    short = turned(measured(1, seconds=20.0))
    assert force_response(data_of(opened, short)) is None
    assert refuse_reversed_forces(data_of(opened, short)) == ""
    assert refuse_reversed_forces(data_of(opened, turned(measured(1)), residual="commanded")) == ""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "shown"), VTEC.items())
def test_exchanged_thrusters_of_single_real_runs(
    name: str, shown: bool, shared_data: Callable[[str], Path], tmp_path: Path
) -> None:
    log = shared_data(f"vtec_usv/{name}.bag")
    told = refuse_reversed_forces(recorded([log], load_profile("vtec-usv"), tmp_path))
    assert told == "" or name.startswith("52000")
    if shown:
        with pytest.raises(FerryIdError, match=r"exchanged \(port and starboard") as error:
            fit_logs([str(log)], exchanged(), FitSettings(), RunContext(tmp_path))
        assert LINES in str(error.value)
        return
    # The vessel follows neither the moment nor the thrust there.
    assert refuse_reversed_forces(recorded([log], exchanged(), tmp_path)).startswith((UNKNOWN, AGAINST))


@pytest.mark.slow
@pytest.mark.parametrize("vessel", OTHERS)
def test_sound_recordings_are_never_refused(vessel: str, shared_data: Callable[[str], Path], tmp_path: Path) -> None:
    folder = shared_data(OTHERS[vessel].partition("/")[0])
    logs = sorted(folder.parent.glob(OTHERS[vessel]))
    assert logs
    for log in logs:
        found = force_response(recorded([log], load_profile(vessel), tmp_path))
        assert found is not None
        assert np.isnan(found.reversed).all(), log.name
    refuse_reversed_forces(recorded(logs, load_profile(vessel), tmp_path))
