"""Windows of the weak form of one log, with all that a fit needs of the log besides: its motion is then no longer needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from ferryid.identify.excitation import SECTORS, heading_sectors
from ferryid.identify.log_sums import moments_of
from ferryid.identify.rows import known_rows
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import block_number, purge_seconds, split_rows
from ferryid.identify.weak_data import every_second
from ferryid.identify.weak_rows import WeakRows, average_over_windows
from ferryid.identify.window_loads import LoadSamples, sample_load
from ferryid.models import payload_kg, validity_ranges
from ferryid.models.forces import compute_residual
from ferryid.regression import window_rows
from ferryid.regression.bases import Basis
from ferryid.signals.complementary_filter import complementary_filter
from ferryid.signals.track import Motion, segments
from ferryid.types import Flags, Floats, Ints
from ferryid.vessel.dimensions import window_seconds
from ferryid.vessel.profile import Profile


@dataclass(frozen=True, eq=False)
class WindowPart:
    """Windows of the marked rows of one log.

    Attributes
    ----------
    measured, steadied
        J windows with the measured velocity in products, and with the one whose slow errors are replaced by the
        position's.
    load_measured, load_steadied
        Where the wind load is evaluated, with either velocity; None where there is none to estimate.
    second
        Numbers of marked rows, one a second, shape (n,).
    nu
        Velocities of these [m/s, m/s, rad/s], shape (n, 3).
    force, base
        Count, mean and sum of squares about the mean of measured and base model's force on all marked rows, shape (3, 3).
    ranges
        Ranges of validity of all marked rows.
    sectors
        Marked rows in each of twelve sectors of heading, shape (12,).
    rows
        Number of marked rows.
    blocks
        Number of blocks as long as the usual window that their unbroken stretches hold.
    """

    measured: WeakRows
    steadied: WeakRows
    load_measured: LoadSamples | None
    load_steadied: LoadSamples | None
    second: Ints
    nu: Floats
    force: Floats
    base: Floats
    ranges: Mapping[str, tuple[float, float]]
    sectors: Ints
    rows: int
    blocks: int

    def windows(self, steadied: bool) -> WeakRows:
        """Return the windows with the one velocity or the other."""
        return self.steadied if steadied else self.measured

    def load(self, steadied: bool) -> LoadSamples | None:
        """Return where the wind load is evaluated with the one velocity or the other."""
        return self.load_steadied if steadied else self.load_measured

    def none(self) -> WindowPart:
        """Return a part like this one without any row."""
        empty = self.between(0, 0, 1)
        return replace(
            empty,
            force=np.zeros((3, 3)),
            base=np.zeros((3, 3)),
            ranges=dict.fromkeys(self.ranges, (np.nan, np.nan)),
            sectors=np.zeros(SECTORS, dtype=np.int64),
            rows=0,
            blocks=0,
        )

    def between(self, low: int, high: int, length: int) -> WindowPart:
        """Return the windows of `length` rows within the rows from `low` to before `high`; what is not of windows stays."""
        return self._taken(
            (self.measured.start >= low) & (self.measured.start + length <= high),
            (self.second >= low) & (self.second < high),
        )

    def without(self, low: int, high: int, length: int) -> WindowPart:
        """Return the windows of `length` rows without any of the rows from `low` to before `high`; see `between`."""
        return self._taken(
            (self.measured.start >= high) | (self.measured.start + length <= low),
            (self.second >= high) | (self.second < low),
        )

    def _taken(self, windows: Flags, seconds: Flags) -> WindowPart:
        loads = [
            None if one is None else replace(one, psi=one.psi[windows], nu=one.nu[windows])
            for one in (self.load_measured, self.load_steadied)
        ]
        return replace(
            self,
            measured=_selected(self.measured, windows),
            steadied=_selected(self.steadied, windows),
            load_measured=loads[0],
            load_steadied=loads[1],
            second=self.second[seconds],
            nu=self.nu[seconds],
        )


@dataclass(frozen=True, eq=False)
class LogWindows:
    """One log as windows.

    Attributes
    ----------
    name, sha256, files
        Of the log.
    basis
        Name of the basis that its measurements allow.
    rate_hz
        Rows per second.
    length_s
        Length of a window [s].
    purge_s
        Time [s] between training and validation rows.
    rows
        Number of rows on which all is known.
    parts
        Training and validation rows; or all rows, of a log that is one block or taken as a whole.
    warnings
        Signals that contradict each other, and which rows are not used and why, as sentences.
    """

    name: str
    sha256: str
    files: tuple[str, ...]
    basis: str
    rate_hz: float
    length_s: float
    purge_s: float
    rows: int
    parts: tuple[WindowPart, ...]
    warnings: tuple[str, ...] = ()

    @property
    def whole(self) -> WindowPart | None:
        """All rows, where these were not divided."""
        return self.parts[0] if len(self.parts) == 1 else None

    @property
    def length(self) -> int:
        """Rows of a window."""
        return window_rows(self.length_s, self.rate_hz)


def divided_rows(motion: Motion, window_s: float) -> tuple[Flags, ...]:
    """Return training and validation rows of a log as a split by blocks has them; all rows of one too short for that."""
    purge_s = purge_seconds(motion.rate_hz, window_s)
    if block_number(np.count_nonzero(motion.valid) / motion.rate_hz, purge_s) < 3:
        return (motion.valid,)
    parts = split_rows([motion], "blocks", window_s=window_s)
    return parts.training[0], parts.validation[0]


def average_log(
    profile: Profile,
    settings: FitSettings,
    functions: Basis,
    motion: Motion,
    *,
    divided: bool,
    sha256: str = "",
    files: Sequence[str] = (),
    warnings: Sequence[str] = (),
) -> LogWindows:
    """Average the equations of motion of one log over windows.

    Parameters
    ----------
    profile, settings, functions
        Vessel, base model and length of a window, and the basis.
    motion
        The log, smoothed.
    divided
        Whether training and validation rows are kept apart, as a split by blocks has them.
    sha256, files, warnings
        What is told of the log.

    Raises
    ------
    FerryIdError
        For a log without a row on which all is known.
    """
    error = compute_residual(profile, motion, settings.scale)
    motion = replace(motion, valid=known_rows(motion, functions, error, error))
    length_s = settings.weak_window_s or window_seconds(profile)
    steadied = complementary_filter(motion.nu, motion.nu, motion.eta, motion.rate_hz)
    masks = divided_rows(motion, settings.window_s) if divided else (motion.valid,)

    def part(rows: Flags) -> WindowPart:
        both = [
            average_over_windows(motion, rows, profile, settings.scale, functions, length_s, velocity)
            for velocity in (motion.nu, steadied)
        ]
        loads = [
            sample_load(profile, motion, velocity, one, length_s)
            for velocity, one in zip((motion.nu, steadied), both, strict=True)
        ]
        seconds = every_second(rows, motion.rate_hz)
        lengths = [(one.stop - one.start) / motion.rate_hz for one in segments(rows)]
        return WindowPart(
            measured=both[0],
            steadied=both[1],
            load_measured=loads[0],
            load_steadied=loads[1],
            second=seconds,
            nu=motion.nu[seconds],
            force=moments_of(motion.tau[rows]),
            base=moments_of(motion.tau[rows] - error[rows]),
            ranges=validity_ranges(
                motion.nu[rows], motion.nu_dot[rows], None if motion.payload is None else payload_kg(motion, rows)
            ),
            sectors=heading_sectors(motion.eta[rows, 2]),
            rows=int(np.count_nonzero(rows)),
            blocks=sum(int(one / window_seconds(profile) + 1e-9) for one in lengths),
        )

    return LogWindows(
        name=motion.log,
        sha256=sha256,
        files=tuple(files),
        basis=functions.name,
        rate_hz=motion.rate_hz,
        length_s=length_s,
        purge_s=purge_seconds(motion.rate_hz, settings.window_s),
        rows=int(np.count_nonzero(motion.valid)),
        parts=tuple(part(rows) for rows in masks),
        warnings=tuple(warnings),
    )


def _selected(windows: WeakRows, chosen: Flags) -> WeakRows:
    """Return the chosen windows, (J,); those that are no neighbours any more lie in stretches of their own."""
    kept = {one.name: getattr(windows, one.name)[chosen] for one in fields(windows)}
    follows = np.diff(np.flatnonzero(chosen)) == 1
    breaks = ~(follows & (np.diff(kept["run"]) == 0))
    kept["run"] = np.concatenate([np.zeros(min(1, len(kept["run"])), dtype=np.int64), np.cumsum(breaks)])
    return WeakRows(**kept)
