"""The picture of a planned trial: its path, its headings over time, and what it is expected to gain."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ferryid.planning import Plan
from ferryid.report.figures import BASE, NEW, STYLE, WIDTH, plain_log, svg_text


def picture(plan: Plan) -> str:
    """Draw a plan as SVG: path and headings where it has a path, and the deviations expected of every coefficient."""
    with mpl.rc_context(STYLE):
        panels = 1 if plan.track is None else 3
        figure = Figure(figsize=(WIDTH, 3.4 if panels == 1 else 9.0), layout="constrained")
        if plan.track is None:
            deviations = figure.subplots()
        else:
            ratios = [1.6, 0.7, 1.1]
            path, headings, deviations = figure.subplots(3, 1, height_ratios=ratios)
            _path(path, plan)
            _headings(headings, plan)
        _deviations(deviations, plan)
        return svg_text(figure)


def _path(ax: Axes, plan: Plan) -> None:
    assert plan.track is not None
    poses, (long, wide) = plan.track.poses, sorted(plan.track.area, reverse=True)
    ax.plot(poses[:, 0], poses[:, 1], color=NEW, linewidth=1.2)
    every = max(1, len(poses) // 60)
    u, v = np.cos(poses[::every, 2]), np.sin(poses[::every, 2])
    ax.quiver(
        poses[::every, 0], poses[::every, 1], u, v, angles="xy", color="#555555", width=0.002, scale=28.0, headwidth=4.0
    )
    ax.plot([-long / 2, long / 2, long / 2, -long / 2, -long / 2], [-wide / 2, -wide / 2, wide / 2, wide / 2, -wide / 2], "--",
            color="#888888", linewidth=0.8)  # fmt: skip
    ax.set_aspect("equal")
    ax.invert_yaxis()  # starboard of the longer side is below it
    ax.set_xlabel("along the longer side [m]")
    ax.set_ylabel("to starboard [m]")
    ax.set_title("Path, with the bow every few seconds; dashed: the area")


def _headings(ax: Axes, plan: Plan) -> None:
    assert plan.track is not None
    minutes = np.arange(len(plan.track.poses)) * plan.track.step_s / 60.0
    ax.plot(minutes, np.degrees(plan.track.poses[:, 2]), color=NEW, linewidth=1.2)
    for k, one in enumerate(plan.chosen, 1):
        ax.axvline(one.begin_s / 60.0, color="#bbbbbb", linewidth=0.7)
        ax.annotate(str(k), (one.begin_s / 60.0, 1.0), (2, -9), xycoords=("data", "axes fraction"), textcoords="offset points",
                    fontsize=8, color="#555555")  # fmt: skip
    ax.set_xlabel("time [min]")
    ax.set_ylabel("heading [deg]")
    ax.set_title("Heading from the longer side; numbers: the manoeuvres")


def _deviations(ax: Axes, plan: Plan) -> None:
    x = np.arange(len(plan.hull))
    for values, colour, label in (
        ([one.usual / one.now for one in plan.hull], BASE, f"after {plan.usual}"),
        ([one.planned / one.now for one in plan.hull], NEW, "after the planned trial"),
    ):
        ax.plot(x, values, "o", color=colour, label=label, markersize=5)
    ax.set_yscale("log")
    plain_log(ax, x=False, y=True)
    ax.set_xticks(x, [one.name for one in plan.hull], rotation=60, ha="right")
    ax.set_ylabel("deviation over that now")
    ax.set_title("Expected standard deviations of the hull's coefficients")
    ax.legend(loc="best")
