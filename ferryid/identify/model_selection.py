"""The choice of smoothing window and component count: what ``fit`` does for ``auto``, and ``sweep`` shows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ferryid.counts import counted
from ferryid.identify.inertia.shares import implausible_inertia, without_inertia
from ferryid.identify.settings import WINDOWS_S, FitSettings, check_window
from ferryid.identify.split import block_number, purge_seconds
from ferryid.identify.thresholds import IDENTIFY
from ferryid.models.forces import effective_mass
from ferryid.regression import fit_simpls, total
from ferryid.regression.bases import Basis
from ferryid.regression.cross_validation import Curves, Folds
from ferryid.signals.smooth import Measured, longest_stretch_s, odd_rows
from ferryid.types import Flags, Floats
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class Selection:
    """What cross-validation chose.

    Attributes
    ----------
    window, window_s, components
        Number of the window, its length [s], and number of components.
    held
        Axes on which the inertia is the base model's, shape (3,).
    curves
        The errors that it rests on, with the inertia of these axes held.
    """

    window: int
    window_s: float
    components: int
    held: Flags
    curves: Curves

    @property
    def title(self) -> str:
        """What was chosen, in words."""
        return f"{counted(self.components, 'component')} at a window of {self.window_s:.3g} s"

    @property
    def over_base(self) -> Floats:
        """MSE of every combination over the base model's, shape (W, A, 3); NaN where the base model makes no error."""
        base = np.where(self.curves.base > 0.0, self.curves.base, np.nan)
        return np.asarray(self.curves.mse / base)


def distinct_windows(windows_s: Iterable[float], rates_hz: Sequence[float]) -> tuple[float, ...]:
    """Return the windows [s] in order, without those that come to the same rows as a shorter one at every rate [Hz]."""
    kept: dict[tuple[int, ...], float] = {}
    for window_s in sorted(windows_s):
        kept.setdefault(tuple(odd_rows(window_s, rate) for rate in rates_hz), window_s)
    return tuple(kept.values())


def windows_to_try(
    windows_s: Sequence[float], measured: Sequence[Measured], *, in_blocks: bool = False
) -> tuple[float, ...]:
    """Return the windows to try [s], distinct ones; of the usual, where none is given, those that suit the logs.

    With `in_blocks` those, too, that leave no log with blocks to train and blocks to validate on do not suit.
    """
    for window_s in windows_s:
        check_window(window_s, "--windows")
    if tuple(windows_s) in ((), WINDOWS_S):
        longest_s = min(longest_stretch_s(one) for one in measured) / IDENTIFY.window_stretches
        windows_s = [w for w in WINDOWS_S if w <= longest_s]
        if in_blocks:
            windows_s = [w for w in windows_s if any(_divides(one, w) for one in measured)]
    return distinct_windows(windows_s, [one.rate_hz for one in measured])


def _divides(measured: Measured, window_s: float) -> bool:
    """Return whether a log is long enough for blocks that train and blocks that validate at a window [s]."""
    seconds = np.count_nonzero(measured.usable) / measured.rate_hz - window_s
    return block_number(seconds, purge_seconds(measured.rate_hz, window_s)) >= 3


def select_model(
    profile: Profile,
    settings: FitSettings,
    functions: Basis,
    windows_s: Sequence[float],
    folds: Folds,
    without_force: Flags,
    *,
    before: Floats | None = None,
    rule: Callable[[Curves], tuple[int, int]] = Curves.choice,
    where: str = "sweep",
) -> Selection:
    """Return the window and the component count that cross-validation cannot tell from the best and that are simplest.

    Parameters
    ----------
    profile, settings, functions, windows_s
        As in `ferryid.identify.log_sums.sum_log`. The inertia is held where a fit would hold it.
    folds
        Of logs that were studied at these windows.
    without_force
        Axes on which no actuator acts, shape (3,); see `force_free_axes`.
    before
        Coefficients that those fitted here come on top of, shape (K, 3).
    rule
        Takes the window and the number of components from the errors; by default the simplest near the best.
    where
        What is fitted, for messages.

    Raises
    ------
    FerryIdError
        With fewer than two folds that hold rows.
    """
    most = len(functions.terms)
    fitted = functions.mask.any(axis=0)
    held = without_force & fitted if settings.inertia == "auto" else np.zeros(3, dtype=bool)
    while True:
        allowed = without_inertia(functions.mask, functions.terms, held)
        curves = folds.curves(allowed, most, where)
        window, components = rule(curves)
        if settings.components != "auto":
            components = min(int(settings.components), most)
            window = int(np.argmin(curves.normalised()[0][:, components - 1]))
        choice = Selection(window, windows_s[window], components, held, curves)
        if settings.inertia != "auto":
            return choice
        theta = fit_simpls(total(folds.training[window]), components, allowed=allowed).coefficients[-1]
        mass = effective_mass(profile, settings.scale, functions.terms, theta + (0.0 if before is None else before))
        more = implausible_inertia(profile, mass) & fitted & ~held
        if not more.any():
            return choice
        held = held | more
