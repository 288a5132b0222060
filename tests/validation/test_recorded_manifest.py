"""Lists of recordings, and recordings that cannot carry an effect: one clear line each, and the others go on."""

from __future__ import annotations

import re
from math import log
from pathlib import Path

import pytest

from ferryid.errors import FerryIdError
from ferryid.validation.recorded.case_sampling import sample_recorded
from ferryid.validation.recorded.effects import concealments
from ferryid.validation.recorded.manifest import Recording, fingerprint, load_recordings
from ferryid.vessel import load_profile
from tests.validation.recorded_logs import BAG, tanker, zigzag

HEAD = 'schema = "ferryid.recordings/1"\n'
ENTRY = '[[recording]]\nlog = "a.csv"\nvessel = "milliampere"\n'


def listed(folder: Path, text: str) -> Path:
    path = folder / "list.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_paths_lead_from_the_list(tmp_path: Path) -> None:
    campaign = 'campaign = ["b.bag", "c.bag+d.bag"]\nvessel = "own.toml"\nruns = 0.5\nonly = ["wind"]\n'
    text = f'{HEAD}{ENTRY}name = "first"\n[[recording]]\n{campaign}'
    first, second = load_recordings(str(listed(tmp_path, text)), None)
    assert first == Recording("first", (str(tmp_path / "a.csv"),), "milliampere", 1.0)
    assert second.logs == (str(tmp_path / "b.bag"), f"{tmp_path / 'c.bag'}+{tmp_path / 'd.bag'}")
    assert (second.name, second.vessel, second.runs) == ("b", str(tmp_path / "own.toml"), 0.5)
    assert second.only == ("wind",)
    assert fingerprint([first]) != fingerprint([second])
    before = fingerprint([first])
    (tmp_path / "a.csv").write_text("t,x\n")
    assert fingerprint([first]) != before


def test_a_log_is_a_list_of_one(tmp_path: Path) -> None:
    assert load_recordings(str(BAG), "milliampere") == (Recording("short", (str(BAG),), "milliampere"),)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("recording = 3", "needs schema"),
        (HEAD, "names no recording"),
        (HEAD + "recording = [1]", "names no recording"),
        (HEAD + ENTRY + 'wessel = "x"\n', 'there is no key "wessel". Did you mean "vessel"'),
        (HEAD + '[[recording]]\nvessel = "x"\n', 'needs either log = "..." or campaign'),
        (HEAD + ENTRY + 'campaign = ["b"]\n', 'needs either log = "..." or campaign'),
        (HEAD + '[[recording]]\nlog = 3\nvessel = "x"\n', 'needs either log = "..." or campaign'),
        (HEAD + '[[recording]]\nlog = "a"\n', "needs vessel, found None"),
        (HEAD + ENTRY + "name = 3\n", '"name" is text'),
        (HEAD + ENTRY + "runs = 0\n", "runs is a factor above 0, found 0"),
        (HEAD + ENTRY + "only = 3\n", "only is a list of effects, found 3"),
        (
            HEAD + ENTRY + 'only = ["winds"]\n',
            'only names "winds", which is no effect that can be concealed. Did you mean "wind"',
        ),
        (HEAD + ENTRY + ENTRY, 'two recordings are called "a"'),
        ("schema = ", "cannot be read as a list of recordings"),
    ],
)
def test_faults_of_a_list(tmp_path: Path, text: str, wanted: str) -> None:
    with pytest.raises(FerryIdError, match=re.escape(wanted)) as error:
        load_recordings(str(listed(tmp_path, text)), None)
    assert "Fix: " in str(error.value)
    assert "list.toml" in str(error.value)


def test_a_log_needs_its_vessel_and_a_list_none(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match="found neither a manifest"):
        load_recordings(str(BAG), None)
    with pytest.raises(FerryIdError, match="there is no such log or manifest"):
        load_recordings(str(tmp_path / "gone.bag"), "milliampere")
    with pytest.raises(FerryIdError, match="a manifest names its vessels"):
        load_recordings(str(listed(tmp_path, HEAD + ENTRY)), "milliampere")
    with pytest.raises(FerryIdError, match=r"none\.toml: cannot be read"):
        load_recordings(str(tmp_path / "none.toml"), None)


@pytest.fixture(scope="module")
def places(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Recordings of some minutes, of ten seconds, and one with a pause."""
    folder = tmp_path_factory.mktemp("recordings")
    long, short, pause = (
        zigzag(folder / f"{name}.dat", seconds) for name, seconds in (("a", 170), ("b", 10), ("c", 170))
    )
    rows = pause.read_text("cp1252").splitlines()
    pause.write_text("\n".join([*rows[:500], *rows[700:]]) + "\n", encoding="cp1252")
    return {"long": str(long), "short": str(short), "pause": str(pause)}


@pytest.mark.slow
def test_what_cannot_be_used_is_a_line_and_the_others_go_on(places: dict[str, str], tmp_path: Path) -> None:
    unfed = tmp_path / "unfed.toml"
    sections = re.split(r"^(?=\[)", load_profile("kvlcc2-model").text, flags=re.MULTILINE)
    unfed.write_text("".join(one for one in sections if not re.match(r'\[signals\."propeller\.(thrust|speed)', one)))
    every = (
        Recording("long", (places["long"],), "kvlcc2-model"),
        Recording("short", (places["short"],), "kvlcc2-model"),
        Recording("other vessel", (places["long"],), "vtec-usv"),
        Recording("gone", (places["long"] + "x",), "kvlcc2-model"),
        Recording("pause", (places["pause"],), "kvlcc2-model"),
        Recording("no feedback", (places["long"],), str(unfed)),
    )
    drawn = sample_recorded(every, 3, 0.2)
    why = {one.recording: one.why for one in drawn.not_made if not one.effect}
    assert set(why) == {"short", "other vessel", "gone", "no feedback"}
    assert "has no thrust or speed signal" in why["no feedback"]
    assert "too short for a diagnosis, found 10 s with" in why["short"]
    assert "is needed by the profile vtec-usv" in why["other vessel"]
    assert all("Fix: " in line and "\n" not in line for line in why.values())
    names = {one.path for one in drawn.cases}
    assert names == {"long", "pause"}
    lacking = {one.effect: one.why for one in drawn.not_made if one.recording == "pause"}
    assert (
        lacking["payload"] == "payload cannot be concealed in pause: its actuators cannot push freely in sway and yaw."
    )
    with pytest.raises(FerryIdError, match=r"none of these effects can be concealed") as refused:
        sample_recorded(every[:2], 3, 0.2, ["payload", "current"])
    # Every reason is told, and what the recording could carry instead.
    assert "cannot push freely" in str(refused.value)
    assert "no hull model" in str(refused.value)
    assert re.search(r"Fix: conceal others, such as --only \w+,\w+,\w+$", str(refused.value))
    with pytest.raises(FerryIdError, match=r"no recording can be used\. The first: .*too short"):
        sample_recorded(every[1:2], 3, 0.2)


@pytest.mark.slow
def test_cases_of_a_seed_are_the_same_and_each_recording_is_one(places: dict[str, str]) -> None:
    every = (
        Recording("long", (places["long"],), "kvlcc2-model"),
        Recording("again", (places["long"],), "kvlcc2-model", only=("heading_bias",)),
    )
    drawn = sample_recorded(every, 3, 1.0, ["thruster_gain", "lever_arm"])
    assert drawn == sample_recorded(every, 3, 1.0, ["thruster_gain", "lever_arm"])
    assert drawn != sample_recorded(every, 4, 1.0, ["thruster_gain", "lever_arm"])
    kinds = sorted((one.kind, one.cell) for one in drawn.cases)
    assert kinds == [
        ("clean", "unaltered: again"),
        ("clean", "unaltered: long"),
        *[("single", "lever_arm: long")] * 5,
        ("span", "thruster_gain: long"),
    ]
    # Beside a hull that nobody knows, the only propeller's force all along is not seen.
    whys = [one.why for one in drawn.not_made if one.effect == "thruster_gain"]
    assert len(whys) == 5
    assert all("an oracle sees none" in why for why in whys)
    assert [one.name for one in drawn.cases] == [f"{number:03d}" for number in range(8)]
    least, most = concealments()["lever_arm"].sizes(tanker())
    sizes = sorted(one.size for one in drawn.cases if one.cell.startswith("lever_arm"))
    assert [int(5.0 * _share(size, least, most)) for size in sizes] == [0, 1, 2, 3, 4]
    with pytest.raises(FerryIdError, match="no effect that can be concealed is called 'winds'"):
        sample_recorded(every, 3, 1.0, ["winds"])


def _share(size: float, least: float, most: float) -> float:
    return log(size / least) / log(most / least)
