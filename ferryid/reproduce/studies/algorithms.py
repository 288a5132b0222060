"""Sections 2.3.2 and 2.3.3: SIMPLS against NIPALS, and the principal components of the basis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np

from ferryid.identify.adaptive import data_matrix
from ferryid.regression import Rows, component_covariances, factorise, fit_nipals, fit_simpls, principal_components
from ferryid.report.drawing import Drawing, Line, Panel
from ferryid.reproduce.flight import controlled, fly, trial, weather_seed
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import BASE, THESIS
from ferryid.reproduce.study import Row, Study, Table, median, number, spread
from ferryid.types import Floats

PLACE = 90
COMPONENTS = 12
SHOWN = 18
COMPARED = (1, COMPONENTS, SHOWN)
REPEATS = 3


@dataclass(frozen=True)
class Outcome:
    """One seed: seconds of either algorithm from data matrix to coefficients, covariance per component, how far the
    coefficients of `COMPARED` numbers of components are apart, variance explained."""

    seconds: tuple[float, float]
    covariance: Floats
    difference: tuple[float, float, float]
    explained: Floats
    rank: int


def study(lab: Lab) -> Study:
    """Compare algorithms on round 1 of Experiment 1."""
    outcomes = lab.each_seed(_compare, "SIMPLS, NIPALS and PCA")
    faster = tuple(one.seconds[1] / one.seconds[0] for one in outcomes)
    held = np.array([one.covariance for one in outcomes])
    share = tuple(float(one.covariance[0].sum() / one.covariance[1].sum()) for one in outcomes)
    explained = np.array([one.explained for one in outcomes])
    rows = (
        Row("time of NIPALS over that of SIMPLS, 12 components", "", "more than 1", faster),
        Row("covariance held by 12 components, SIMPLS over NIPALS", "", "at least 1", share),
        Row(
            "principal components of the basis that vary at all",
            "",
            "21 functions",
            tuple(float(o.rank) for o in outcomes),
        ),
        Row(
            "variance in the first 12 principal components",
            "% of all",
            None,
            tuple((100 * explained[:, :COMPONENTS].sum(axis=1)).tolist()),
        ),
    )
    table = Table(
        "By component: covariance with the residual that SIMPLS and NIPALS hold, and variance of the basis that "
        "each principal "
        "component explains (medians).",
        ("component", "SIMPLS", "NIPALS", "variance explained [%]", "cumulative [%]"),
        tuple(
            (
                str(a + 1),
                *(number(float(np.median(held[:, k, a]))) if a < COMPONENTS else "" for k in (0, 1)),
                number(100 * float(np.median(explained[:, a]))),
                number(100 * float(np.median(explained[:, : a + 1].sum(axis=1)))),
            )
            for a in range(SHOWN)
        ),
    )
    x = np.arange(1, SHOWN + 1, dtype=float)
    return Study(
        "algorithms",
        "SIMPLS against NIPALS, and PCA of the basis (section 2.3)",
        "Is SIMPLS faster than NIPALS and does it hold more covariance, and how many directions does the basis have?",
        (
            "Round 1 of Experiment 1, columns and outputs divided by their standard deviation. Times are the shortest of "
            f"{REPEATS}, from the data matrix to the coefficients; they are the only numbers on this page that "
            f"change from run to run.",
        ),
        rows,
        (table,),
        tuple(_findings(outcomes, faster, share, explained)),
        (
            Drawing(
                "basis-variance",
                "Variance of the basis explained by its principal components.",
                "number of components",
                (
                    Panel(
                        "cumulative [%]",
                        (Line("basis", x, 100 * np.median(np.cumsum(explained, axis=1), axis=0), marked=True),),
                    ),
                ),
            ),
        ),
    )


def _compare(folder: Path, seed: int) -> Outcome:
    flight = fly(folder, "training", controlled(trial("experiment-1"), BASE), weather_seed(seed, 1))
    data = data_matrix(flight.profile, [flight.motion(THESIS.window_s)], THESIS)
    X, Y = data.X, data.Y
    one = fit_simpls(factorise(Rows.of(X, Y)), COMPONENTS)
    other = fit_nipals(X, Y, COMPONENTS)
    parts = principal_components(factorise(Rows.of(X, Y)))
    explained = np.zeros(SHOWN)
    explained[: min(SHOWN, len(parts.explained))] = parts.explained[:SHOWN]
    deep = min(SHOWN, len(parts.explained))
    fits = fit_simpls(factorise(Rows.of(X, Y)), deep).coefficients, fit_nipals(X, Y, deep).coefficients
    apart = [_apart(*(fit[min(a, deep) - 1] * parts.scale[:, None] for fit in fits)) for a in COMPARED]
    return Outcome(
        (
            _shortest(lambda: fit_simpls(factorise(Rows.of(X, Y)), COMPONENTS)),
            _shortest(lambda: fit_nipals(X, Y, COMPONENTS)),
        ),
        np.array([component_covariances(one.weights[0], X, Y), component_covariances(other.rotations, X, Y)]),
        (apart[0], apart[1], apart[2]),
        explained,
        len(parts.explained),
    )


def _apart(one: Floats, other: Floats) -> float:
    return float(100.0 * np.linalg.norm(one - other) / np.linalg.norm(one))


def _shortest(work: Callable[[], object]) -> float:
    times = []
    for _ in range(REPEATS):
        start = perf_counter()
        work()
        times.append(perf_counter() - start)
    return min(times)


def _findings(
    outcomes: list[Outcome], faster: tuple[float, ...], share: tuple[float, ...], explained: Floats
) -> list[str]:
    seconds = [1e3 * median([one.seconds[k] for one in outcomes]) for k in (0, 1)]
    enough = int(np.argmax(np.median(np.cumsum(explained, axis=1), axis=0) >= 0.99) + 1)
    return [
        f"SIMPLS takes {number(seconds[0])} ms, NIPALS {number(seconds[1])} ms: {spread(faster)} times. SIMPLS "
        f"here works on "
        "cross-products, so that the rows are passed once, whatever the number of components.",
        f"Twelve components of SIMPLS hold {spread(share)} times the covariance of those of NIPALS. The two models' "
        "coefficients (times the spread of their function) differ by "
        + ", ".join(f"{spread([one.difference[k] for one in outcomes], '%')} with {a}" for k, a in enumerate(COMPARED))
        + " components.",
        f"The 21 functions vary in {spread([float(one.rank) for one in outcomes])} directions, and the first "
        f"{enough} of these hold 99 % of the "
        "variance: three pairs of functions are identical.",
    ]
