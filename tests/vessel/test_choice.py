"""Whose log it is: asked for, stated beside the log or in the environment, or the one profile that fits."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.vessel import choose_vessel, load_profile
from ferryid.vessel.choice import VARIABLE

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
MILLIAMPERE = load_profile("milliampere").text


def twin(name: str = "twin") -> str:
    """Return the text of a profile with the signals of milliampere, and another name."""
    return MILLIAMPERE.replace('name = "milliampere"', f'name = "{name}"', 1)


@pytest.fixture(autouse=True)
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give the folder of the user's own profiles, empty."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    folder = tmp_path / "config" / "ferryid" / "vessels"
    folder.mkdir(parents=True)
    return folder


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """Give a log of milliampere in a folder of its own."""
    folder = tmp_path / "season" / "day"
    folder.mkdir(parents=True)
    return Path(shutil.copy(FIXTURES / "short.mcap", folder / "a.mcap"))


def test_the_only_profile_that_fits(log: Path) -> None:
    choice = choose_vessel([log])
    assert (choice.profile.name, choice.reference) == ("milliampere", "milliampere")
    assert choice.reason == "vessel milliampere: bundled, the only profile whose signals this log has"


def test_columns_without_names_say_that_they_are_chosen_by_their_places(tmp_path: Path) -> None:
    rows = [" ".join(f"{0.05 * k + place:.3f}" for place in range(12)) for k in range(60)]
    log = tmp_path / "towed.dat"
    log.write_text("\n".join(["a", "b", "c", "d", *rows, ""]), encoding="utf-8")
    assert choose_vessel([log]).reason == (
        "vessel kvlcc2-model: bundled, the only profile whose signals this log has, by the places of 12 columns: make sure "
        "that it is this vessel's"
    )


def test_a_log_that_no_profile_fits_does_not_decide_for_most_that_have_one(log: Path) -> None:
    second = Path(shutil.copy(log, log.parent / "b.mcap"))
    foreign = log.parent / "foreign.csv"
    foreign.write_text("time,temperature\n0,1\n1,2\n2,3\n", encoding="utf-8")
    choice = choose_vessel([log, foreign, second])
    assert choice.profile.name == "milliampere"
    assert choice.reason == "vessel milliampere: bundled, the only profile whose signals 2 of 3 logs have"
    # Of as many that fit none it is not known whose they are.
    with pytest.raises(FerryIdError, match=r"foreign\.csv: no vessel profile fits this log"):
        choose_vessel([log, foreign])


def test_what_is_asked_for_counts_first_and_needs_no_reason(log: Path) -> None:
    (log.parent / "vessel.toml").write_text(twin(), encoding="utf-8")
    choice = choose_vessel([log], "revolt")
    assert (choice.profile.name, choice.reason) == ("revolt", "")


def test_the_nearest_file_counts_before_the_environment(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "revolt")
    assert choose_vessel([log]).reason == f"vessel revolt: stated in ${VARIABLE}"
    above = log.parents[1] / "vessel.toml"
    above.write_text(twin("above"), encoding="utf-8")
    assert choose_vessel([log]).reason == f"vessel above: from {above}"
    (log.parent / "boat.toml").write_text(twin("boat"), encoding="utf-8")
    beside = log.parent / "ferryid.toml"
    beside.write_text('vessel = "boat.toml"\n', encoding="utf-8")
    assert choose_vessel([log]).reason == f"vessel boat: stated in {beside}"
    (log.parent / "vessel.toml").write_text(twin("other"), encoding="utf-8")
    assert choose_vessel([log]).profile.name == "boat"
    beside.unlink()
    assert choose_vessel([log]).profile.name == "other"


def test_a_file_beside_what_a_link_is_named_not_where_it_leads(log: Path, tmp_path: Path) -> None:
    (log.parent / "vessel.toml").write_text(twin(), encoding="utf-8")
    link = tmp_path / "link.mcap"
    link.symlink_to(log)
    assert choose_vessel([link]).profile.name == "milliampere"


def test_the_users_own_profile_of_a_name_counts_before_the_bundled_one(log: Path, own: Path) -> None:
    (own / "milliampere.toml").write_text(MILLIAMPERE.replace("mass_kg = 1670.0", "mass_kg = 1700.0"), "utf-8")
    choice = choose_vessel([log])
    assert choice.profile.hull.mass_kg == 1700.0
    assert "your own" in choice.reason


def test_two_that_fit_are_listed(log: Path, own: Path) -> None:
    (own / "twin.toml").write_text(twin(), encoding="utf-8")
    with pytest.raises(
        FerryIdError, match=r"2 vessel profiles fit this log.* milliampere \(.*; twin \(.* Fix: give --vessel"
    ):
        choose_vessel([log])


def test_an_own_profile_with_a_fault_does_not_hinder(log: Path, own: Path) -> None:
    (own / "bad.toml").write_text("name = 3\n", encoding="utf-8")
    assert choose_vessel([log]).profile.name == "milliampere"


def test_none_that_fits_shows_what_the_nearest_lacks(own: Path, log: Path) -> None:
    (own / "milliampere.toml").write_text(MILLIAMPERE.replace("/navigation/odometry", "/nav"), "utf-8")
    with pytest.raises(
        FerryIdError, match=r"no vessel profile fits.* milliampere \(lacks position, heading, velocity, \.\.\.; 4 of"
    ):
        choose_vessel([log])


def test_logs_of_two_vessels(log: Path, own: Path, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    second = shutil.copy(log, other / "b.mcap")
    for folder, name in ((log.parent, "one"), (other, "two")):
        (folder / "vessel.toml").write_text(twin(name), encoding="utf-8")
    with pytest.raises(FerryIdError, match=r"b\.mcap: is of another vessel than .*a\.mcap"):
        choose_vessel([log, second])
    (other / "vessel.toml").unlink()
    assert choose_vessel([log, second]).profile.name == "one"


def test_logs_that_different_profiles_fit(log: Path, own: Path, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("time,U,V,R,N\n" + "".join(f"{0.1 * k:.1f},1,0,0,5\n" for k in range(50)), encoding="utf-8")
    text = """schema = "ferryid.vessel/1"
name = "tabled"
source = "made up"
[hull]
length_m = 5.0
mass_kg = 100.0
inertia_z = 200.0
[[actuator]]
name = "jet"
kind = "force"
position_m = [-1.0, 0.0]
[table]
time = "time"
[signals."jet.force"]
topic = "table"
field = "N"
unit = "N"
[signals.velocity]
topic = "table"
fields = ["U", "V"]
unit = "m/s"
frame = "FRD"
[signals.yaw_rate]
topic = "table"
field = "R"
unit = "rad/s"
frame = "FRD"
"""
    (own / "tabled.toml").write_text(text, encoding="utf-8")
    assert choose_vessel([table]).profile.name == "tabled"
    with pytest.raises(FerryIdError, match=r"they fit different ones: .*a\.mcap milliampere; .*table\.csv tabled"):
        choose_vessel([log, table])


@pytest.mark.parametrize(
    ("name", "text", "told"),
    [
        ("vessel.toml", "name = \n", r"vessel\.toml:1: not valid TOML"),
        ("vessel.toml", twin().replace("mass_kg = 1670.0", "mass_kg = -1"), r'vessel\.toml:\d+: .*"mass_kg"'),
        ("ferryid.toml", "[fit\n", r"ferryid\.toml: the defaults for options cannot be read.* Fix:"),
        ("ferryid.toml", "vessel = 3\n", r"ferryid\.toml:1: vessel cannot be 3\. Fix:"),
        ("ferryid.toml", 'vessel = "nowhere.toml"\n', r"nowhere\.toml: the vessel profile cannot be read"),
    ],
)
def test_a_file_with_a_fault(log: Path, name: str, text: str, told: str) -> None:
    (log.parent / name).write_text(text, encoding="utf-8")
    with pytest.raises(FerryIdError, match=told):
        choose_vessel([log])


def test_an_environment_with_a_fault(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "milliamper")
    with pytest.raises(
        FerryIdError, match=r'^\$FERRYID_VESSEL: milliamper: no vessel profile .* Did you mean "milliampere"'
    ):
        choose_vessel([log])


def test_a_log_that_is_not_there() -> None:
    with pytest.raises(FerryIdError, match=r"nowhere\.bag: no such file"):
        choose_vessel(["nowhere.bag"])


def test_beside_a_model_its_own_profile_serves_where_it_can(log: Path) -> None:
    own = load_profile("milliampere")
    assert choose_vessel([log], own=own).profile is own
    stated = log.parent / "vessel.toml"
    stated.write_text(MILLIAMPERE + "\n# as it is now\n", encoding="utf-8")
    assert choose_vessel([log], own=own).profile is own
    revolt = load_profile("revolt")
    assert choose_vessel([log], own=revolt).reason == f"vessel milliampere: from {stated}"
    stated.unlink()
    assert choose_vessel([log], own=revolt).profile is revolt


def test_a_fault_beside_the_log_matters_only_where_the_profile_of_the_model_does_not_serve(log: Path) -> None:
    (log.parents[1] / "vessel.toml").write_text("name = \n", encoding="utf-8")
    own = load_profile("milliampere")
    assert choose_vessel([log], own=own).profile is own
    with pytest.raises(FerryIdError, match=r"vessel\.toml:1: not valid TOML"):
        choose_vessel([log], own=load_profile("revolt"))


FOLDERS = {
    "esso-osaka": "esso_osaka/*/*.csv",
    "gunnerus": "gunnerus/*.csv",
    "kvlcc2-model": "kvlcc2/HSVA*.dat",
    "milliampere-2025": "milliampere1",
    "vtec-usv": "vtec_usv/*.bag",
}
"""Recordings that bundled profiles map."""


@pytest.mark.slow
@pytest.mark.parametrize("name", FOLDERS)
def test_every_recording_finds_its_profile(shared_data: Callable[[str], Path], name: str) -> None:
    folder, _, pattern = FOLDERS[name].partition("/")
    root = shared_data(folder)
    logs = sorted(root.glob(pattern)) if pattern else [root]
    assert logs
    for log in logs:
        assert choose_vessel([log]).profile.name == name


@pytest.mark.parametrize("log", ["aauship/aauship_control_2017-05-24-17-43-31.bag", "vtec_usv/edge"])
def test_a_recording_that_no_profile_maps(shared_data: Callable[[str], Path], log: str) -> None:
    with pytest.raises(FerryIdError, match="no vessel profile fits this log"):
        choose_vessel([shared_data(log)])
