"""The picture of a planned trial: its path, every manoeuvre by itself, motion over time, and what it is expected to gain."""

from __future__ import annotations

from itertools import pairwise
from math import ceil

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, MultipleLocator, NullLocator

from ferryid.planning import Plan
from ferryid.planning.plan import Chosen, Track
from ferryid.report.figures import BASE, NEW, STYLE, WIDTH, svg_text
from ferryid.types import Floats
from ferryid.vessel.dimensions import dimensions

COLUMNS = 4
"""Small maps beside each other."""
OUTLINES, SMALL_OUTLINES = 40, 10
"""Outlines of the vessel on the map of the whole path, and on that of a manoeuvre."""
TURNS = (45.0, 90.0, 180.0, 360.0, 720.0, 1800.0, 3600.0)
"""Steps between the ticks of a heading [deg]: whole turns or parts of them."""
MOST_TICKS = 7
LETTER, LINE = 0.062, 1.22
"""Mean width of a letter of 7 points, and the width that a small map has for its title [inch]."""
GREY, PALE = "#555555", "#999999"


def picture(plan: Plan) -> str:
    """Draw a plan as SVG: path, manoeuvres and motion where it has a path, and the deviations expected of every coefficient."""
    with mpl.rc_context({**STYLE, "font.size": 9, "axes.titlesize": 10, "axes.titlelocation": "left"}):
        rows = 0.9 + 0.17 * len(plan.hull)
        if plan.track is None:
            figure = Figure(figsize=(WIDTH, rows), layout="constrained")
            _deviations(figure.subplots(), plan)
            return svg_text(figure)
        different = _different(plan.chosen)
        long, wide = sorted(plan.track.area, reverse=True)
        map_height = 0.75 + 5.0 * wide / long
        small = ceil(len(different) / COLUMNS) * (0.36 + 1.36 * wide / long) + 0.3
        heights = [map_height, small, 3.3, rows]
        figure = Figure(figsize=(WIDTH, sum(heights)), layout="constrained")
        of_path, of_each, of_time, of_gain = figure.subfigures(4, 1, height_ratios=heights, squeeze=False).flat
        _whole(of_path.subplots(), plan)
        _each(of_each, plan, plan.track, different)
        _motion(of_time, plan, plan.track)
        _deviations(of_gain.subplots(), plan)
        return svg_text(figure)


def _different(chosen: tuple[Chosen, ...]) -> list[tuple[str, Chosen]]:
    """Return the manoeuvres that differ, each with the numbers of the places where it is sailed."""
    numbers = dict[str, list[int]]()
    for k, one in enumerate(chosen, 1):
        numbers.setdefault(one.says, []).append(k)
    first = {one.says: one for one in reversed(chosen)}
    return [(", ".join(map(str, places)), first[says]) for says, places in numbers.items()]


def _map(ax: Axes, track: Track, poses: Floats, size: tuple[float, float], outlines: int, width: float) -> None:
    """Draw a part of a path within the area, with the outline of the vessel at even distances of way and turn."""
    long, wide = sorted(track.area, reverse=True)
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]) * [long / 2, wide / 2]
    ax.plot(*corners.T, "--", color=PALE, linewidth=0.8)
    ax.plot(poses[:, 0], poses[:, 1], color=NEW, linewidth=width)
    for k in _spread(poses, size[0], outlines):
        hull = _outline(poses[k], size)
        ax.fill(hull[:, 0], hull[:, 1], facecolor=NEW, edgecolor=NEW, alpha=0.16, linewidth=0.0)
        ax.plot(hull[:, 0], hull[:, 1], color=GREY, linewidth=0.5)
    ax.set_aspect("equal")
    ax.set_xlim(-0.53 * long, 0.53 * long)
    ax.set_ylim(0.5 * wide + 0.03 * long, -0.5 * wide - 0.03 * long)  # starboard of the longer side is below it


def _spread(poses: Floats, length: float, count: int) -> list[int]:
    """Return rows at even distances of way and turn: a vessel on the spot is not drawn again and again."""
    moved = np.abs(np.diff(poses, axis=0)) @ [1.0, 1.0, 0.3 * length]
    way = np.concatenate([[0.0], np.cumsum(moved)])
    rows = np.searchsorted(way, np.linspace(0.0, way[-1], count + 1)[:-1])
    return sorted(set(rows.tolist()))


def _outline(pose: Floats, size: tuple[float, float]) -> Floats:
    """Return the corners of a hull with a pointed bow at a pose, its length and beam in m."""
    shape = np.array([(0.5, 0.0), (0.25, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.25, -0.5), (0.5, 0.0)]) * size
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return np.asarray(pose[:2] + shape @ np.array([[c, s], [-s, c]]))


def _whole(ax: Axes, plan: Plan) -> None:
    assert plan.track is not None
    _map(ax, plan.track, plan.track.poses, dimensions(plan.vessel)[:2], OUTLINES, 0.9)
    ax.plot(0.0, 0.0, "o", color=BASE, markersize=4.5, zorder=5)
    ax.annotate("start", (0.0, 0.0), (7, 7), textcoords="offset points", color=BASE, bbox=_halo(), zorder=6)
    ax.set_xlabel("along the longer side [m]")
    ax.set_ylabel("to starboard [m]")
    ax.set_title("Whole path with the vessel's outline; dashed: the area")


def _halo() -> dict[str, object]:
    return {"boxstyle": "round,pad=0.15", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}


def _each(figure: SubFigure, plan: Plan, track: Track, different: list[tuple[str, Chosen]]) -> None:
    """Draw a small map of every manoeuvre that differs, with its numbers in the order of the trial."""
    rows = ceil(len(different) / COLUMNS)
    axes = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    figure.suptitle(
        "Manoeuvres by themselves, with their numbers", x=0.02, ha="left", fontsize=mpl.rcParams["axes.titlesize"]
    )
    for ax in axes[len(different) :]:
        ax.set_axis_off()
    for ax, (numbers, one) in zip(axes, different, strict=False):
        first, end = (round(at / track.step_s) for at in (one.begin_s, one.end_s))
        _map(ax, track, track.poses[first:end], dimensions(plan.vessel)[:2], SMALL_OUTLINES, 0.9)
        ax.set_xticks([])
        ax.set_yticks([])
        ax.spines[:].set_visible(False)
        room = int(LINE / LETTER) - len(one.kind)
        told = numbers if len(numbers) <= room else f"{numbers[: room - 1].rpartition(',')[0]}, …"
        ax.set_title(f"{told}  {one.kind}", fontsize=8, pad=2)


def _motion(figure: SubFigure, plan: Plan, track: Track) -> None:
    """Draw heading, and speeds along the vessel's axes, over time, with the numbers of the manoeuvres above them."""
    heading, speeds = figure.subplots(2, 1, sharex=True, height_ratios=[1.0, 1.0])
    poses = track.poses
    minutes = np.arange(len(poses)) * track.step_s / 60.0
    degrees = np.degrees(poses[:, 2])
    heading.plot(minutes, degrees, color=NEW)
    span = float(np.ptp(degrees))
    step = next((one for one in TURNS if span / one <= MOST_TICKS), TURNS[-1])
    heading.yaxis.set_major_locator(MultipleLocator(step))
    heading.set_ylabel("heading [deg]")
    heading.set_title("Heading from the longer side, and speeds, by manoeuvre", pad=16)
    rate = np.gradient(poses[:, :2], track.step_s, axis=0)
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    speeds.plot(minutes, c * rate[:, 0] + s * rate[:, 1], color=NEW, label="ahead")
    speeds.plot(minutes, c * rate[:, 1] - s * rate[:, 0], color=BASE, label="to starboard")
    speeds.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    speeds.set_ylabel("speed [m/s]")
    speeds.set_xlabel("time [min]")
    speeds.set_xlim(0.0, minutes[-1])
    # Below the axis: the curves reach everywhere else.
    speeds.legend(loc="upper right", bbox_to_anchor=(1.0, -0.2), ncols=2, borderaxespad=0.0)
    apart = 0.0
    for ax in (heading, speeds):
        for one in plan.chosen:
            ax.axvline(one.begin_s / 60.0, color="#cccccc", linewidth=0.7, zorder=0)
    ends = [*(one.begin_s for one in plan.chosen), plan.chosen[-1].end_s] if plan.chosen else []
    for k, (first, end) in enumerate(pairwise(ends), 1):
        middle = 0.5 * (first + end) / 60.0
        # Of many short ones not every number has room.
        if middle - apart >= 0.035 * minutes[-1]:
            heading.annotate(str(k), (middle, 1.0), (0, 3), xycoords=("data", "axes fraction"), textcoords="offset points",
                             ha="center", va="bottom", color=GREY)  # fmt: skip
            apart = middle


def _deviations(ax: Axes, plan: Plan) -> None:
    """Draw what either trial leaves of every coefficient's standard deviation, a row each."""
    y = np.arange(len(plan.hull))
    usual, planned = (np.array([getattr(one, name) / one.now for one in plan.hull]) for name in ("usual", "planned"))
    colours = np.where(planned <= usual, NEW, BASE).tolist()
    ax.hlines(y, np.minimum(usual, planned), np.maximum(usual, planned), colors=colours, alpha=0.45,
              linewidth=2.0)  # fmt: skip
    ax.plot(usual, y, "o", markerfacecolor="white", color=BASE, label=f"after {plan.usual}", markersize=5)
    ax.plot(planned, y, "o", color=NEW, label="after the planned trial", markersize=5)
    ax.set_xscale("log")
    ax.set_xlim(0.8 * min(usual.min(), planned.min(), 0.1), 1.25)
    # Over many powers of ten, those alone have room.
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if ax.get_xlim()[0] > 2e-3 else (1.0,)))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100.0 * value:.3g} %"))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.set_yticks(y, [one.name for one in plan.hull])
    ax.set_ylim(len(y) - 0.4, -0.6)
    ax.set_xlabel("expected standard deviation, relative to the present one")
    ax.set_title("What remains unknown of the hull's coefficients", pad=24)
    ax.legend(
        loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=2, borderaxespad=0.1, columnspacing=1.2, handletextpad=0.3
    )
