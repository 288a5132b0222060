"""``python -m tests.plans`` writes reports/plan.md."""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from tests.evidence import stamp
from tests.plans.study import FRESH, Found, study
from tests.real.places import REPORTS

AIM = 0.5
AIM_SEPARATED = 0.8


def main() -> None:
    """Plan, simulate and estimate for every vessel, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.plans")
    parser.add_argument("--vessels", type=int, default=20, help="simulated vessels")
    count = parser.parse_args().vessels
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        found = list(pool.map(study, (*range(count), *range(FRESH, FRESH + count))))
    page = REPORTS / "plan.md"
    page.write_text(written(found[:count], found[count:]), encoding="utf-8")
    stamp(page)


def written(found: list[Found], fresh: list[Found]) -> str:
    """Return the page, of vessels that the design was looked at with, and of others."""
    ratios, others = (np.array([one.planned / one.usual for one in some]) for some in (found, fresh))
    middle, of_others = float(np.median(ratios)), float(np.median(others))
    rows = [
        f"| {one.vessel} | {one.usual:.4f} | {one.planned:.4f} | {one.planned / one.usual:.2f} | {one.expected_median:.2f} "
        f"| {one.expected:.2f} | {one.pairs} | {one.separated} | {one.separated_by_usual} |"
        for one in found
    ]
    pairs = sum(one.pairs for one in found)
    separated, by_usual = (sum(getattr(one, name) for one in found) for name in ("separated", "separated_by_usual"))
    reached = "reached" if separated >= AIM_SEPARATED * pairs else "missed"
    vessels = [_of_vessel(name, found) for name in dict.fromkeys(one.vessel for one in found)]
    return "\n".join(
        [
            "# Planned trials against the usual one",
            "",
            f"Written by `make plans VESSELS={len(found)}`. Each vessel is a bundled one whose coefficients of the hull are",
            "off at random by the standard deviation of the prior. The plan knows the profile alone. A twelve-corner trial",
            "and the planned one of the same length are simulated in calm water with the sensors' noise, and the hull",
            "is estimated from each by the weak form.",
            "",
            f"Median error after the planned trial over that after the twelve-corner trial: **{middle:.2f}** (aim {AIM:g}; "
            f"{'reached' if middle <= AIM else 'missed'}); smaller in {int(np.sum(ratios < 1.0))} of {len(found)} vessels.",
            f"Over {len(fresh)} vessels of other seeds, which no choice was made by: **{of_others:.2f}**, smaller in "
            f"{int(np.sum(others < 1.0))}.",
            *vessels,
            "",
            *_calibration([*found, *fresh]),
            "",
            "Pairs of effects of usual size that a straight run leaves unresolved, and the trial planned after it resolves:",
            f"**{separated} of {pairs}** (aim {AIM_SEPARATED:.0%}; {reached}). A twelve-corner trial resolves {by_usual}.",
            "",
            "Errors are medians over the coefficients, in standard deviations of the prior. *Promised*: the ratio of the",
            "medians of the standard deviations, as the errors are compared. *Stated*: the median of the ratios, by",
            "`ferryid plan`.",
            "*Pairs*: left unresolved by a straight run, and resolved by the planned and by the usual trial after it.",
            "",
            "| vessel | twelve corners | planned | ratio | promised | stated | pairs | planned | usual |",
            "|---|--:|--:|--:|--:|--:|--:|--:|--:|",
            *rows,
            "",
        ]
    )


def _calibration(found: list[Found]) -> list[str]:
    """Return how far the errors reach beyond what the estimates state."""
    usual, planned = (float(np.sqrt(np.mean([one.scaled[k] ** 2 for one in found]))) for k in (0, 1))
    return [
        f"Errors over the standard deviations that the estimate itself states, rms: {usual:.2f} after the usual trial and",
        f"{planned:.2f} after the planned one (1: as stated).",
    ]


def _of_vessel(name: str, found: list[Found]) -> str:
    """Return what came of one kind of vessel, and what was to be expected, as an item of a list."""
    own = [one for one in found if one.vessel == name]
    ratio, expected = (
        float(np.median(values))
        for values in ([one.planned / one.usual for one in own], [one.expected_median for one in own])
    )
    usual = float(np.median([one.usual for one in own]))
    return (
        f"- {name}: {ratio:.2f}, where the information of the two trials promises {expected:.2f}. The usual trial leaves "
        f"{usual:.2g} of what the profile leaves open."
    )


if __name__ == "__main__":
    main()
