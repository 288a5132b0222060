"""Ticks of figures: copied, and drawn as matplotlib would draw its own."""

from __future__ import annotations

import io

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axis import Tick
from matplotlib.figure import Figure

from ferryid.report.figures import STYLE, canvas, plain_log, svg_text


def figure() -> Figure:
    """Panels with a shared axis, logarithmic and plain axes, ticks with words, an offset, a title and unequal limits."""
    drawn, axes = canvas(3, 5.0)
    x = np.linspace(1.0, 900.0, 50)
    axes[0].loglog(x, x**3)
    plain_log(axes[0], x=True, y=True)
    axes[0].set_title("title")
    axes[1].plot(x, 1e7 + 1e-3 * x)
    axes[1].set_yticks([1e7, 1e7 + 0.5], ["low", "high"])
    axes[1].tick_params(axis="y", labelrotation=30, colors="red")
    axes[2].plot(x, 1e7 + x)
    axes[2].set_aspect("equal", adjustable="datalim")
    return drawn


def test_a_figure_of_copied_ticks_is_the_one_that_matplotlib_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    with mpl.rc_context(STYLE):
        plain = io.StringIO()
        figure().savefig(plain, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
        made = []
        make = Tick.__init__

        def counted(tick: Tick, *given: object, **named: object) -> None:
            made.append(tick)
            make(tick, *given, **named)  # type: ignore[arg-type]

        drawn = figure()
        monkeypatch.setattr(Tick, "__init__", counted)
        text = svg_text(drawn)
        assert text == plain.getvalue()[plain.getvalue().index("<svg") :]
        assert text.count('id="xtick_') > 20
        # One of a kind and axis at most.
        assert len(made) <= 2 * 2 * len(drawn.axes)
