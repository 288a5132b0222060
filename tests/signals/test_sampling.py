"""Logs whose time stands still, is of another unit, or advances too slowly are refused with the remedy."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ferryid.errors import FerryIdError
from ferryid.report.structure import spectrum
from ferryid.signals.inspect import inspect
from ferryid.signals.prepare import prepare
from ferryid.vessel.load import parse_profile
from ferryid.vessel.profile import Profile

TOML = """
schema = "ferryid.vessel/1"
name = "boat"
source = "test"
[hull]
length_m = 5.0
mass_kg = 1000.0
k_zz_m = 1.2
[table]
time = "t"
[[actuator]]
name = "main"
kind = "force"
position_m = [-1.5, 0.0]
[signals.velocity]
topic = "table"
fields = ["u", "v"]
unit = "m/s"
frame = "FRD"
[signals.yaw_rate]
topic = "table"
field = "r"
unit = "rad/s"
frame = "FRD"
[signals."main.force"]
topic = "table"
field = "F"
unit = "N"
"""


@pytest.fixture
def boat() -> Profile:
    return parse_profile(TOML, "boat.toml")


def table(folder: Path, times: list[str]) -> str:
    n = np.arange(len(times))
    rows = zip(times, np.sin(n / 9), np.cos(n / 7), np.sin(n / 5) / 9, 90 * np.cos(n / 11), strict=True)
    lines = [",".join((t, *(f"{value:.6f}" for value in values))) for t, *values in rows]
    path = folder / "x.csv"
    path.write_text("t,u,v,r,F\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return str(path)


@pytest.mark.parametrize(
    ("times", "told"),
    [
        ([str(100 * n) for n in range(300)], r'every 100 s.*look like milliseconds, so set time_unit = "ms" under'),
        ([str(100_000 * n) for n in range(300)], r'look like microseconds, so set time_unit = "us" under \[table\]'),
        ([str(1744362945123 + 100 * n) for n in range(300)], r'look like milliseconds, so set time_unit = "ms"'),
        ([str(10 * n) for n in range(300)], r"at least 0\.7 Hz\. Fix: record the navigation at a higher rate"),
        (["5.0"] * 300, r"x\.csv: time does not advance, found 300 rows of table with the same time\. Fix: name"),
        (["5.0"], r"x\.csv: table holds one row only"),
        ([""] * 9, r"no row has a readable time in column .t. \(s\), found an empty cell"),
    ],
)
def test_a_wrong_time_column_is_explained_by_fit_and_inspect(
    tmp_path: Path, boat: Profile, times: list[str], told: str
) -> None:
    path = table(tmp_path, times)
    with pytest.raises(FerryIdError, match=told):
        prepare(path, boat, tmp_path / "out", window_s=1.0)
    vessel = inspect(path, boat)["vessel"]
    assert not vessel["usable"]
    assert vessel["problem"]


FOLDER = TOML.replace('topic = "table"\nfields', 'topic = "/nav"\nfields')
for field in "rF":
    FOLDER = FOLDER.replace(f'topic = "table"\nfield = "{field}"', f'topic = "/navy_{field}"\nfield = "{field}"')


@pytest.mark.parametrize("layout", ['[table]\ntime = "t"', ""])
@pytest.mark.parametrize(
    ("content", "told"),
    [
        (
            b"",
            r"nav\.csv: velocity is needed by the profile boat, and its file cannot be used: the file is empty \(0 bytes\)",
        ),
        (b"t,u,v\n", r"nav\.csv: velocity is needed .* a header and no rows\. Fix: record or export the log again"),
        (b"t,u,v\n0.0,1.0,2.0\n", r"nav\.csv: /nav holds one row only, and motion needs many\. Fix: use a longer log"),
        (bytes(range(256)) * 40, r"nav\.csv: velocity is needed .*: this is binary data, not a text table\. Fix: "),
    ],
)
def test_a_file_of_a_folder_that_cannot_be_used_is_named_and_not_the_profile(
    tmp_path: Path, layout: str, content: bytes, told: str
) -> None:
    profile = parse_profile(FOLDER.replace('[table]\ntime = "t"', layout), "boat.toml")
    folder = tmp_path / "run"
    folder.mkdir()
    n = np.arange(600)
    for name in "rF":
        rows = "\n".join(f"{0.1 * k:.1f},{value:.6f}" for k, value in zip(n, np.sin(n / 7), strict=True))
        (folder / f"navy_{name}.csv").write_text(f"t,{name}\n{rows}\n", encoding="utf-8")
    (folder / "nav.csv").write_bytes(content)
    with pytest.raises(FerryIdError, match=told) as error:
        prepare(str(folder), profile, tmp_path / "out", window_s=1.0)
    assert "Did you mean" not in str(error.value)
    assert "boat.toml" not in str(error.value)
    vessel = inspect(folder, profile)["vessel"]
    assert (vessel["usable"], vessel["problem"]) == (False, str(error.value))


def test_rows_out_of_order_are_not_taken_for_another_unit(tmp_path: Path, boat: Profile) -> None:
    times = np.random.default_rng(1).permutation(2000) * 0.05
    path = table(tmp_path, [f"{t:.2f}" for t in times])
    with pytest.raises(FerryIdError, match=r"Fix: sort the rows by time, which goes back \d+ times$"):
        prepare(path, boat, None, window_s=1.0)
    # A clock that was set back once leaves the unit in doubt.
    path = table(tmp_path, [str(100 * (n if n < 200 else n - 50)) for n in range(300)])
    with pytest.raises(FerryIdError, match="look like milliseconds"):
        prepare(path, boat, None, window_s=1.0)


def test_a_log_of_one_sample_per_second_is_taken(tmp_path: Path, boat: Profile) -> None:
    prepared = prepare(table(tmp_path, [str(n) for n in range(300)]), boat, tmp_path / "out", window_s=1.0)
    assert "Smoothing: none, a window of 1 s holds one row at 1 Hz." in prepared.motion.repairs
    assert inspect(table(tmp_path, [str(n) for n in range(300)]), boat)["vessel"]["usable"]


def test_a_grid_that_is_too_slow_for_the_vessel_is_refused_as_such_a_log_is(tmp_path: Path, boat: Profile) -> None:
    path = table(tmp_path, [f"{0.1 * n:.1f}" for n in range(300)])
    with pytest.raises(
        FerryIdError, match=r"--rate: 0\.5 Hz is too slow for a fit, a vessel of .* at least 0\.7 Hz\. Fix"
    ):
        prepare(path, boat, tmp_path / "out", window_s=1.0, rate_hz=0.5)
    assert prepare(path, boat, tmp_path / "out", window_s=1.0, rate_hz=1.0).motion.rate_hz == 1.0


def test_the_spectrum_of_a_slow_log_is_no_crash() -> None:
    n = 200
    motion = SimpleNamespace(
        rate_hz=0.01, valid=np.ones(n, dtype=bool), tau=np.random.default_rng(1).normal(size=(n, 3))
    )
    frequency, density = spectrum(SimpleNamespace(motion=motion, tau_model=np.zeros((n, 3))), "tau_model", 0)  # type: ignore[arg-type]
    assert frequency.size == density.size > 0
