"""What findings do over the dates of their logs: a fouling that grows, a payload that steps.

Two rank tests, whose chances come from shuffled dates: Spearman's correlation for growth, and Pettitt (1979), "A
non-parametric approach to the change-point problem", Applied Statistics 28, for one step. Neither asks how the values scatter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan

import numpy as np

from ferryid.batch.summary import parameters_of
from ferryid.counts import counted, verb
from ferryid.diagnose import JUDGING
from ferryid.effects import effects
from ferryid.effects.wording import titled
from ferryid.report.batch_rows import FindingSummary, Key, SummaryRow, Trend, TrendLog, TrendPoint, by_date
from ferryid.types import Floats
from ferryid.vessel.profile import Profile

FEWEST = 6
"""Logs below which no trend is told: five in perfect order are no rarity."""
CHANCE = 0.01
"""Of shuffled dates to look as much like a trend, above which none is told."""
SHUFFLES = 4000
NO_TREND = ("onset", "offset", "duration")
"""Parameters that are times within a log."""
WITH_THE_REST = {"gusts": ("time_constant",), "waves": ("time_constant", "peak_frequency")}
"""Parameters without a meaning where the effect is absent, beside those of effects that say so themselves."""


def trends_of(rows: Sequence[SummaryRow], profiles: Mapping[str, Profile]) -> tuple[Trend, ...]:
    """Return every parameter of every effect that was found, over the logs of its vessel.

    Hints count as well: what is doubtful in each of many logs, and yet moves with their dates, is so less.

    Parameters
    ----------
    rows
        Of all logs.
    profiles
        By the names of the vessels.

    Returns
    -------
    tuple
        One entry a vessel and parameter: by date where all logs of the vessel have one, else in the order of the logs.
    """
    found = []
    for vessel, profile in profiles.items():
        own, dated = by_date([row for row in rows if row.vessel == vessel and row.diagnose])
        for key, name in parameters_of(own).values():
            several = [row.finding(key) for row in own]
            if name not in NO_TREND:
                found.append(_trend(vessel, profile, own, several, key, name, dated))
    return tuple(found)


def _trend(
    vessel: str,
    profile: Profile,
    rows: Sequence[SummaryRow],
    several: Sequence[FindingSummary | None],
    key: Key,
    name: str,
    dated: bool,
) -> Trend:
    effect = effects().get(key[0])
    title = titled(effect.title if effect else key[0].replace("_", " ").capitalize(), key[1])
    neutral = _neutral(profile, key[0], name)
    points, absent, seen = [], [], []
    for place, (row, one) in enumerate(zip(rows, several, strict=True)):
        if one is not None and name in one.parameters:
            found = one.parameters[name]
            points.append(
                TrendPoint(row.name, row.date, place, found.value, found.low, found.high, found.unit, one.probability)
            )
            seen.append((place, found.value))
        elif one is None and row.diagnose is not None and row.diagnose.verdict != "not_testable":
            absent.append(TrendLog(row.name, row.date, place))
            if neutral is not None:
                seen.append((place, neutral))
    places = [place for place, _ in seen]
    kind, change = trend([nan if value is None else value for _, value in seen])
    unit = points[0].unit
    hints = sum(point.probability <= JUDGING.hint_probability for point in points)
    doubt = f" ({hints} of {counted(len(points), 'finding')} {verb(hints, 'is')} hints)" if hints else ""
    what = f"{vessel}: {title}, {name.replace('_', ' ')}"
    return Trend(
        vessel=vessel,
        effect=key[0],
        instance=key[1],
        parameter=name,
        title=title,
        unit=unit,
        neutral=neutral,
        dated=dated,
        points=tuple(points),
        absent=tuple(absent),
        kind=kind,
        change=change,
        sentence=f"{_sentence(what, unit, kind, change, [rows[k] for k in places])}{doubt}" if kind else "",
    )


def _neutral(profile: Profile, effect: str, name: str) -> float | None:
    """Return what a parameter is where its effect is absent; None for one that then has no meaning."""
    known = effects().get(effect)
    every = known.parameters_of(profile) if known else ()
    one = next((parameter for parameter in every if parameter.name == name), None)
    if one is None or name in WITH_THE_REST.get(effect, ()):
        return None
    if one.start is None and any(parameter.start is not None for parameter in every):
        return None
    return one.neutral


def trend(values: Sequence[float]) -> tuple[str | None, dict[str, float]]:
    """Return ``"grows"``, ``"falls"`` or ``"steps"`` for values in the order of their dates, None where neither is seen.

    Parameters
    ----------
    values
        Shape (n,).

    Returns
    -------
    str, dict
        Kind, and its numbers: ``chance`` that shuffled dates look as much like it; ``before`` and ``after``, the medians of
        what is before and after a step, or of the first and the last third; of a step ``at``, the number of values before it.
    """
    y = np.asarray(values, dtype=np.float64)
    n = len(y)
    if n < FEWEST or np.all(y == y[0]):
        return None, {}
    ranks = _ranks(y) - 0.5 * (n + 1)
    order = np.arange(n) - 0.5 * (n - 1)
    rng = np.random.default_rng(n)
    shuffled = rng.permuted(np.tile(ranks, (SHUFFLES, 1)), axis=1)
    monotone = _chance(float(abs(ranks @ order)), np.abs(shuffled @ order))
    sums = np.cumsum(ranks)[:-1]
    one_step = _chance(float(np.abs(sums).max()), np.abs(np.cumsum(shuffled, axis=1)[:, :-1]).max(axis=1))
    if min(monotone, one_step) >= CHANCE:
        return None, {}
    at = int(np.argmax(np.abs(sums))) + 1
    slope = float(order @ y / (order @ order))
    line = float(np.sum((y - y.mean() - slope * order) ** 2))
    step = float(sum(np.sum((part - part.mean()) ** 2) for part in (y[:at], y[at:])))
    if one_step < CHANCE and (step < line or monotone >= CHANCE):
        before, after = float(np.median(y[:at])), float(np.median(y[at:]))
        return "steps", {"chance": one_step, "before": before, "after": after, "at": at}
    ends = {"before": float(np.median(y[: n // 3])), "after": float(np.median(y[-(n // 3) :]))}
    return "grows" if slope > 0.0 else "falls", {"chance": monotone, **ends}


def _chance(found: float, shuffled: Floats) -> float:
    """Return the share of shuffled values as great as the one found, which counts among them."""
    return float((1 + np.sum(shuffled >= found * (1.0 - 1e-12))) / (1 + len(shuffled)))


def _ranks(y: Floats) -> Floats:
    """Return ranks from 1 on, shape (n,); those that are equal share their mean."""
    _, place, counts = np.unique(y, return_inverse=True, return_counts=True)
    ends = np.cumsum(counts)
    return np.asarray((ends - 0.5 * (counts - 1))[place])


def _sentence(what: str, unit: str, kind: str, change: Mapping[str, float], rows: Sequence[SummaryRow]) -> str:
    unit = "" if unit == "-" else f" {unit}"
    before, after = (f"{change[end]:.3g}{unit}" for end in ("before", "after"))
    if kind == "steps":
        at = int(change["at"])
        return f"{what} steps from {before} to {after} between {_when(rows[at - 1])} and {_when(rows[at])}"
    return f"{what} {kind} from {before} to {after} (first and last third), {_when(rows[0])} to {_when(rows[-1])}"


def _when(row: SummaryRow) -> str:
    return row.date[:10] if row.date else row.name
