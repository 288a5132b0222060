"""Stretches that are left out: the longest are listed in order of time, the rest counted, and all of them shaded."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ferryid.report.left_out import MOST_SHOWN, left_out_table, shade_left_out
from ferryid.signals.track import LeftOut


def gaps(count: int) -> tuple[LeftOut, ...]:
    """Stretches of 1, 2, ... rows at 10 Hz, one every ten seconds."""
    rows = np.zeros(100 * count, dtype=bool)
    for k in range(count):
        rows[100 * k : 100 * k + k + 1] = True
    return LeftOut.of("not measured", rows, 10.0, 0, lambda _: (("u", "v"), "the receiver was silent"))


def test_the_longest_are_listed_in_order_of_time_and_the_rest_counted() -> None:
    table = left_out_table(gaps(MOST_SHOWN + 3))
    assert [row["start"] for row in table["rows"]] == [f"{10.0 * k:.2f}" for k in range(3, MOST_SHOWN + 3)]
    assert table["rows"][0] == {
        "start": "30.00",
        "end": "30.40",
        "seconds": "0.40",
        "signals": "u, v",
        "reason": "the receiver was silent",
    }
    assert table["rest"] == "And 3 shorter stretches, 0.6 s in all."
    assert left_out_table(gaps(MOST_SHOWN))["rest"] == ""
    assert left_out_table(gaps(MOST_SHOWN + 1))["rest"].startswith("And 1 shorter stretch, ")
    assert left_out_table(()) == {"rows": [], "rest": ""}


def test_stretches_are_shaded_inside_the_frame_with_one_entry_in_the_legend() -> None:
    ax = Figure().subplots()
    shade_left_out(ax, gaps(6), 15.0, 40.2)
    spans = [patch.get_x() for patch in ax.patches]  # type: ignore[attr-defined]
    assert spans == [20.0, 30.0, 40.0]
    assert ax.get_legend_handles_labels()[1] == ["left out"]


def test_times_count_from_the_first_row_of_the_track() -> None:
    (left,) = LeftOut.of("x", np.array([True, True, False, False, True]), 2.0, 2)
    assert [(one.start_s, one.end_s) for one in left.intervals] == [(-1.0, 0.0), (1.0, 1.5)]
    assert (left.rows, left.stretches, left.seconds) == (3, 2, 1.5)
    assert LeftOut.of("x", np.zeros(4, dtype=bool), 2.0) == ()
