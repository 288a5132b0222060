"""``python -m tests.plans`` writes reports/plan.md."""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from tests.evidence import stamp
from tests.plans.study import Found, study
from tests.real.places import REPORTS

AIM = 0.5


def main() -> None:
    """Plan, simulate and estimate for every vessel, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m tests.plans")
    parser.add_argument("--vessels", type=int, default=20, help="simulated vessels")
    count = parser.parse_args().vessels
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        found = list(pool.map(study, range(count)))
    page = REPORTS / "plan.md"
    page.write_text(written(found), encoding="utf-8")
    stamp(page)


def written(found: list[Found]) -> str:
    """Return the page."""
    ratios = np.array([one.planned / one.usual for one in found])
    middle = float(np.median(ratios))
    rows = [
        f"| {one.vessel} | {one.usual:.4f} | {one.planned:.4f} | {one.planned / one.usual:.2f} | {one.expected:.2f} |"
        for one in found
    ]
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
            "",
            "Errors are medians over the coefficients, in standard deviations of the prior. *Expected*: the ratio of standard",
            "deviations that `ferryid plan` states.",
            "",
            "| vessel | twelve corners | planned | ratio | expected |",
            "|---|--:|--:|--:|--:|",
            *rows,
            "",
        ]
    )


if __name__ == "__main__":
    main()
