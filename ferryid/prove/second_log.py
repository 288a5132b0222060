"""What a diagnosis promises, held against a second log of the same vessel in the same conditions; and what rivals do there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan, prod
from typing import Any

import numpy as np
from scipy.stats import binom

from ferryid.diagnose import AXES
from ferryid.prove.names import Line, Share, key_of, named, names, truths, wrong

KEPT = 0.8
"""Part of a claim that counts as keeping it."""
WORTH = 0.1
"""Share of the squared error as of which a claim on an axis is one."""
DIAGNOSED = "diagnosed"


@dataclass(frozen=True)
class Claim:
    """The share of the squared force error that findings claim to remove on an axis, and the one that they remove.

    Attributes
    ----------
    axis
        One of `AXES`.
    logs
        How many logs have a finding that claims something, and a second log.
    claimed, achieved
        Medians.
    apart, low, high
        Median of what is achieved less what is claimed, with its 95 % interval by order statistics.
    kept
        Of the claims of at least `WORTH`: those of which at least `KEPT` is achieved.
    """

    axis: str
    logs: int
    claimed: float
    achieved: float
    apart: float
    low: float
    high: float
    kept: Share


@dataclass(frozen=True)
class Method:
    """What one method does on second logs.

    Attributes
    ----------
    name
        ``diagnosed``, or that of a rival.
    logs
        How many it was judged on.
    mse
        Median ratio of its squared force error to the base model's, by axis.
    free_run
        Median ratio of its position error in free runs to the base model's.
    first
        Logs with a truth in which its first name is one; None for a method without names.
    false
        Logs in which it names what is neither there nor allowed; None for a method without names.
    """

    name: str
    logs: int
    mse: Mapping[str, float]
    free_run: float
    first: Share | None
    false: Share | None


def claimed(line: Line) -> dict[str, float]:
    """Return the share of the squared error that a diagnosis claims to remove, by axis; empty where it claims nothing.

    The diagnosis' own figure of all findings together where it is there. Else that of findings which each remove their share
    of what the others leave.
    """
    ratios = (line["told"].get("after") or {}).get("ratio")
    found = [one["improvement"] for one in named(line) if one.get("improvement")]
    if not found:
        return {}
    if ratios:
        return {axis: 1.0 - float(ratios[axis]["value"]) for axis in AXES}
    return {axis: 1.0 - prod(1.0 - float(one.get(axis, 0.0)) for one in found) for axis in AXES}


def claims(lines: Iterable[Line]) -> tuple[Claim, ...]:
    """Return claims and what became of them, by axis."""
    pairs: dict[str, list[tuple[float, float]]] = {axis: [] for axis in AXES}
    for line in lines:
        said, judged = claimed(line), _judged(line, DIAGNOSED)
        if said and judged:
            for axis in AXES:
                pairs[axis].append((said[axis], 1.0 - float(judged["mse"][axis])))
    return tuple(_claim(axis, some) for axis, some in pairs.items())


def methods(lines: Sequence[Line]) -> tuple[Method, ...]:
    """Return the diagnosis and every rival that was judged on a second log, all on the logs of which rivals were asked.

    Where a diagnosis has left the base model as it was, its errors are the base model's.
    """
    asked = [line for line in lines if line.get("rival_names") or set(line.get("second") or {}) - {"base", DIAGNOSED}]
    lines = asked or lines
    known = [name for line in lines for name in (line.get("second") or {}) if name not in ("base", DIAGNOSED)]
    known += [name for line in lines for name in (line.get("rival_names") or {})]
    found = [_method(name, lines) for name in dict.fromkeys([DIAGNOSED, *known])]
    return tuple(one for one in found if one.logs or (one.false is not None and one.false.of))


def missing(lines: Sequence[Line]) -> dict[str, str]:
    """Return why rivals could not be asked that were asked in vain each time, by name."""
    judged = [(name, one) for line in lines for name, one in (line.get("second") or {}).items() if name != DIAGNOSED]
    able = {name for name, one in judged if _has_errors(one)}
    return {name: str(one["why"]) for name, one in judged if name not in able and one.get("why")}


def median_interval(values: Sequence[float]) -> tuple[float, float]:
    """Return the 95 % interval of a median by order statistics: infinite for fewer than six values."""
    ordered, n = sorted(values), len(values)
    k = int(binom.ppf(0.025, n, 0.5)) if n else 0
    return (ordered[k - 1], ordered[n - k]) if k > 0 else (-inf, inf)


def _claim(axis: str, pairs: Sequence[tuple[float, float]]) -> Claim:
    apart = [achieved - said for said, achieved in pairs]
    worth = [(said, achieved) for said, achieved in pairs if said >= WORTH]
    return Claim(
        axis,
        len(pairs),
        _median([said for said, _ in pairs]),
        _median([achieved for _, achieved in pairs]),
        _median(apart),
        *median_interval(apart),
        Share(sum(achieved >= KEPT * said for said, achieved in worth), len(worth)),
    )


def _method(name: str, lines: Sequence[Line]) -> Method:
    judged = [one for line in lines if (one := _judged(line, name))]
    runs = [_free_run(line, one) for line in lines if (one := _judged(line, name))]
    first, false = _own_names(lines) if name == DIAGNOSED else _rival_names(name, lines)
    mse = {axis: _median([float(one["mse"][axis]) for one in judged]) for axis in AXES}
    return Method(name, len(judged), mse, _median([run for run in runs if isfinite(run)]), first, false)


def _judged(line: Line, name: str) -> Mapping[str, Any]:
    """Return what a method did on the second log of a line; empty where it was not judged."""
    one = (line.get("second") or {}).get(name)
    return one if one and _has_errors(one) else {}


def _has_errors(one: Mapping[str, Any]) -> bool:
    """Tell whether a method was judged: one that is not installed, or that could not learn, has no errors."""
    return all((one.get("mse") or {}).get(axis) is not None for axis in AXES)


def _free_run(line: Line, judged: Mapping[str, Any]) -> float:
    """Return the ratio of position errors, NaN where there is none."""
    base = judged.get("base_position_m")
    if base is None:
        base = (line["second"].get("base") or {}).get("position_m")
    own = judged.get("position_m")
    return float(own) / float(base) if own is not None and base else nan


def _own_names(lines: Sequence[Line]) -> tuple[Share, Share]:
    true = [line for line in lines if truths(line)]
    first = sum(bool(names(line)) and names(line)[0] in {key_of(one) for one in truths(line)} for line in true)
    return Share(first, len(true)), Share(sum(bool(wrong(line)) for line in lines), len(lines))


def _rival_names(name: str, lines: Sequence[Line]) -> tuple[Share | None, Share | None]:
    """Return right first names and wrong names of a rival, which names effects and no thrusters."""
    asked = [line for line in lines if (line.get("rival_names") or {}).get(name) is not None]
    if not asked:
        return None, None
    first = false = true = 0
    for line in asked:
        there, found = {one["effect"] for one in truths(line)}, list(line["rival_names"][name])
        true += bool(there)
        first += bool(found) and found[0] in there
        false += any(one not in there and one not in line["case"]["allowed"] for one in found)
    return Share(first, true), Share(false, len(asked))


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else nan
