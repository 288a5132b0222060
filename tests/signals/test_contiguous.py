"""Short logs that follow each other without a break: which are joined, and into what."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ferryid.signals.contiguous import contiguous
from ferryid.signals.recording import record
from ferryid.signals.thresholds import SIGNALS
from ferryid.vessel import load_profile

SHIP = load_profile("esso-osaka")
COLUMNS = (
    "t [s]", "x_position_mid [m]", "y_position_mid [m]", "psi_hat [rad]", "u_velo [m/s]", "vm_velo [m/s]",
    "r_angvelo [rad/s]", "n_prop [rps]", "delta_rudder [rad]",
)  # fmt: skip
EPOCH_S = 1_600_000_000.0
STEP_S = 0.1


def bag(folder: Path, name: str, begin_s: float, seconds: float, *, shift: float = 0.0) -> str:
    """Write a table of slow motion that begins at a time, and return its path; `shift` is another motion."""
    t = begin_s + STEP_S * np.arange(round(seconds / STEP_S))
    rows = np.column_stack([t, *(np.sin(0.1 * (t % 1000.0) + k + shift) for k in range(len(COLUMNS) - 1))])
    path = folder / f"{name}.csv"
    path.write_text(",".join(COLUMNS) + "\n" + "\n".join(",".join(f"{x:.6f}" for x in row) for row in rows) + "\n")
    return str(path)


def bags(folder: Path, begins_s: list[float], seconds: float = 20.0, *, epoch_s: float = EPOCH_S) -> list[str]:
    return [bag(folder, f"bag{k:03d}", epoch_s + begin, seconds) for k, begin in enumerate(begins_s)]


def test_bags_without_a_break_are_one_log_of_all_their_rows(tmp_path: Path) -> None:
    paths = bags(tmp_path, [20.0 * k for k in range(5)])
    found = contiguous(paths, SHIP)
    assert found.paths == ("+".join(paths),)
    (parts,) = found.parts.values()
    assert [one.path for one in parts] == paths
    assert [one.begin_s for one in parts] == pytest.approx([0.0, 20.0, 40.0, 60.0, 80.0])
    assert found.notes == ("5 logs that follow each other without a break were joined into 1 log of 1.67 min.",)
    assert len(record(found.paths[0], SHIP).streams["table"].time_ns) == 5 * 200


def test_the_order_in_which_bags_are_given_does_not_matter(tmp_path: Path) -> None:
    paths = bags(tmp_path, [0.0, 20.0, 40.0])
    assert contiguous(paths[::-1], SHIP).paths == ("+".join(paths),)


@pytest.mark.parametrize(("pause_s", "logs"), [(0.5 * SIGNALS.break_s, 1), (2.0 * SIGNALS.break_s, 2)])
def test_a_recorder_that_is_restarted_makes_one_log_and_a_pause_two(tmp_path: Path, pause_s: float, logs: int) -> None:
    paths = bags(tmp_path, [0.0, 20.0, 40.0 + pause_s, 60.0 + pause_s])
    found = contiguous(paths, SHIP)
    assert len(found.paths) == logs
    (note,) = found.notes
    assert ("follow each other after breaks of up to 2.6 s were" in note) == (logs == 1)
    assert ("follow each other without a break were" in note) == (logs == 2)


@pytest.mark.parametrize(("pause_s", "logs"), [(0.0, 1), (1.0, 2)])
def test_times_that_are_no_dates_must_go_on_at_the_next_sample(tmp_path: Path, pause_s: float, logs: int) -> None:
    paths = bags(tmp_path, [0.0, 20.0 + pause_s], epoch_s=0.0)
    assert len(contiguous(paths, SHIP).paths) == logs


def test_times_that_are_no_dates_may_meet_by_chance(tmp_path: Path) -> None:
    """Zigzags cut from long recordings keep the times that these count: one may begin when another one ends."""
    first = bag(tmp_path, "first", 0.0, 20.0)
    elsewhere = bag(tmp_path, "elsewhere", 20.0, 20.0, shift=3.0)
    assert contiguous([first, elsewhere], SHIP).paths == (first, elsewhere)
    assert len(contiguous([first, bag(tmp_path, "next", 20.0, 20.0)], SHIP).paths) == 1


def test_runs_of_a_tanker_that_were_cut_from_others_stay_as_they_are(shared_data: Callable[[str], Path]) -> None:
    paths = [str(one) for one in sorted(shared_data("esso_osaka").glob("*/*.csv"))]
    assert contiguous(paths, SHIP).paths == tuple(paths)


def test_bags_whose_times_begin_anew_stay_as_they_are(tmp_path: Path) -> None:
    paths = bags(tmp_path, [0.0, 0.0, 0.0], epoch_s=0.0)
    found = contiguous(paths, SHIP)
    assert found.paths == tuple(paths)
    assert not found.notes


def test_logs_that_can_be_judged_by_themselves_stay_as_they_are(tmp_path: Path) -> None:
    long_s = 2.0 * SIGNALS.short_s
    paths = bags(tmp_path, [0.0, long_s], long_s)
    assert contiguous(paths, SHIP).paths == tuple(paths)


def test_an_hour_of_bags_becomes_logs_of_even_length(tmp_path: Path) -> None:
    paths = bags(tmp_path, [60.0 * k for k in range(50)], 60.0)
    found = contiguous(paths, SHIP)
    lengths = [parts[-1].end_s for parts in found.parts.values()]
    assert len(found.paths) == 3
    assert max(lengths) <= SIGNALS.joined_s
    assert min(lengths) > 0.9 * max(lengths)
    assert [path for parts in found.parts.values() for path in (one.path for one in parts)] == paths


@pytest.mark.parametrize("order", [(0, 1, 2, 3, 4, 5), (3, 1, 5, 0, 4, 2), (0, 4, 2, 3, 1, 5)])
def test_two_recordings_that_were_begun_at_once_are_not_mixed(tmp_path: Path, order: tuple[int, ...]) -> None:
    begins = [0.0, 20.0, 40.0]
    first = bags(tmp_path, begins)
    second = [bag(tmp_path, f"other{k}", EPOCH_S + begin, 20.0, shift=3.0) for k, begin in enumerate(begins)]
    every = [*first, *second]
    assert set(contiguous([every[k] for k in order], SHIP).paths) == {"+".join(first), "+".join(second)}


def test_a_copy_beside_the_bags_is_joined_with_copies_alone(tmp_path: Path) -> None:
    (tmp_path / "again").mkdir()
    paths, copies = (bags(folder, [0.0, 20.0]) for folder in (tmp_path, tmp_path / "again"))
    assert contiguous([paths[0], copies[0], paths[1], copies[1]], SHIP).paths == ("+".join(paths), "+".join(copies))


def test_a_log_that_cannot_be_opened_stays_by_itself(tmp_path: Path) -> None:
    paths = bags(tmp_path, [0.0, 20.0])
    empty = tmp_path / "empty.csv"
    empty.write_text("")
    found = contiguous([paths[0], str(empty), paths[1]], SHIP)
    assert found.paths == ("+".join(paths), str(empty))
    assert found.without(["+".join(paths)]).paths == (*paths, str(empty))


def test_names_of_many_parts_may_be_longer_than_that_of_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    paths = [Path(one).name for one in bags(tmp_path, [20.0 * k for k in range(40)])]
    (path,) = contiguous(paths, SHIP).paths
    assert len(path) > 255
    recording = record(path, SHIP, tmp_path / "out")
    assert recording.name == "bag000-and-39-more"
    assert len(recording.streams["table"].time_ns) == 40 * 200
