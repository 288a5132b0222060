"""A sweep of settings as text for a terminal."""

from __future__ import annotations

import numpy as np

from ferryid.counts import counted
from ferryid.identify import Selection
from ferryid.identify.sweeps import BY, Sweep
from ferryid.types import AXES


def render_sweep(found: Sweep) -> str:
    """Return a sweep for a terminal."""
    lines = [
        headline(found),
        *([found.estimator_says] if found.estimator_says else []),
        fit_with(found),
        by_itself(found),
        "",
    ]
    for key, choice in found.by.items():
        title = f"by {BY[key]}, {counted(choice.curves.folds, 'fold')}, {counted(choice.curves.rows, found.tested)}"
        lines += [title, *(_matrix(found, choice) if found.what == "both" else _table(found, choice)), ""]
    lines += [f"note: {note}" for note in found.notes]
    return "\n".join(lines).rstrip()


def headline(found: Sweep) -> str:
    """Return the choice in one sentence."""
    choice = found.choice
    ratio = choice.over_base[choice.window, choice.components - 1]
    told = ", ".join(f"{axis} {value:.3g}" for axis, value in zip(AXES, ratio, strict=True) if np.isfinite(value))
    error = f"cross-validated {found.error} over the base model's: {told}."
    if found.choice_beats_base:
        return f"Choice: {choice.title}. {error[0].upper()}{error[1:]}"
    beaten = "The choice does not beat" if found.any_beats_base else "No setting beats"
    return f"{beaten} the base model: keep it as it is. Choice, were it fitted all the same: {choice.title}, {error}"


def fit_with(found: Sweep) -> str:
    """Return the options with which a fit uses the choice."""
    return f"{'Fit with' if found.choice_beats_base else 'To fit all the same'}: {' '.join(found.fit_options)}"


def by_itself(found: Sweep) -> str:
    """Return why a fit without these options may choose others, as a sentence."""
    windows = (
        " and, without --weak-window, tries windows of up to three times the usual length"
        if found.weak and found.settings.weak_window_s is None
        else ""
    )
    return f"Without them a fit may take others: it chooses on its training rows alone{windows}."


def _table(found: Sweep, choice: Selection) -> list[str]:
    """Return a line for each component count, or for each window: MSE per axis over the base model's, and the score."""
    score, band = choice.curves.normalised()
    windows, counts = range(len(found.windows_s)), range(score.shape[1])
    if found.what == "window":
        cells = [(window, choice.components - 1, f"{found.windows_s[window]:.3g} s") for window in windows]
    else:
        cells = [(choice.window, count, f"{count + 1}") for count in counts]
    title = "window" if found.what == "window" else "components"
    lines = [f"  {title:<12}" + "".join(f"{axis:>10}" for axis in AXES) + f"{'score':>10}"]
    for window, count, name in cells:
        ratios = "".join(
            f"{value:>10.4g}" if np.isfinite(value) else f"{'–':>10}" for value in choice.over_base[window, count]
        )
        chosen = (window, count) == (choice.window, choice.components - 1)
        lines.append(
            f"{'*' if chosen else ' '} {name:<12}{ratios}{score[window, count]:>10.4f} ± {band[window, count]:.4f}"
        )
    lines.append("  axes: MSE over the base model's; score: each axis over its least MSE, mean; * the choice")
    return lines


def _matrix(found: Sweep, choice: Selection) -> list[str]:
    """Return a line for each component count, a column for each window."""
    score, near = choice.curves.normalised()[0], choice.curves.near()
    lines = ["  components" + "".join(f"{window_s:>9.3g} s" for window_s in found.windows_s)]
    for count in range(score.shape[1]):
        cells = []
        for window in range(len(found.windows_s)):
            chosen = (window, count) == (choice.window, choice.components - 1)
            mark = "*" if chosen else "·" if near[window, count] else " "
            cells.append(f"{score[window, count]:>10.4f}{mark}")
        lines.append(f"  {count + 1:<10}" + "".join(cells))
    lines.append(
        "  each axis over its least MSE, mean; · within one standard error of the paired differences; * the choice"
    )
    return lines
