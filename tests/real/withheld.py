"""Measurements that were withheld from a diagnosis, stored beside the page of the campaigns, and their section in the proof.

``make campaign`` computes them; ``reports/withheld.json`` keeps what its page shows: ``winds``, one object a run, and
``instruments``, sentences on second sources by profile.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from ferryid.files import dump_json, finite, write_text

if TYPE_CHECKING:
    from tests.real.esso import Study

FILE = "withheld.json"


def winds(study: Study, title: str) -> list[dict[str, Any]]:
    """Return the winds of a campaign, measured and estimated without the measurement."""
    found = study.found
    off, strength, inside = (part(study.measured) for part in (found.off, found.strength, found.inside))
    return [
        {
            "campaign": title,
            "run": name,
            "measured_mps": study.measured[k],
            "estimate_mps": found.winds[k],
            "error_mps": found.errors[k],
            "off_deg": off[k],
            "strength": strength[k],
            "inside": int(inside[k].sum()),
            "outcome": "named" if found.has_wind[k] else "hint" if "wind" in found.hinted[k] else "",
        }
        for k, name in enumerate(study.names)
    ]


def store(rows: Sequence[Mapping[str, Any]], instruments: Mapping[str, Sequence[str]], folder: Path) -> None:
    """Write both beside the page."""
    write_text(folder / FILE, dump_json(finite({"winds": list(rows), "instruments": dict(instruments)})))


def section(folder: Path) -> list[str]:
    """Return the section of the proof, as lines; none where nothing is stored."""
    if not (folder / FILE).exists():
        return []
    data = json.loads((folder / FILE).read_text("utf-8"))
    lines = [
        "## Withheld measurements",
        "",
        "What recordings measured besides was hidden from the diagnosis and compared with what it found: the wind of the day,",
        "which nobody concealed. Made by `make campaign`; `reports/campaign.md` has every run and its controls.",
        "",
        "| withheld | runs | named | hints | median angle off [deg] | strength over measured | inside the 95 % interval |",
        "|---|--:|--:|--:|--:|--:|--:|",
    ]
    for title in dict.fromkeys(one["campaign"] for one in data["winds"]):
        some = [one for one in data["winds"] if one["campaign"] == title]
        outcomes = [one["outcome"] for one in some]
        inside = f"{sum(one['inside'] for one in some)}/{2 * len(some)}"
        numbers = (
            f"{median(one['off_deg'] for one in some):.0f}",
            f"{median(one['strength'] for one in some):.2f}",
            inside,
        )
        counts = (str(len(some)), str(outcomes.count("named")), str(outcomes.count("hint")))
        lines.append(f"| wind, Esso Osaka, {title.lower()} | {' | '.join((*counts, *numbers))} |")
    lines += ["", "Second sources of the navigation, which the profile does not map, beside the mapped signals:", ""]
    lines += [f"- {vessel}: {text}" for vessel, texts in data["instruments"].items() for text in texts]
    lines += [
        "",
        "No recording at hand measured a current or a load; `--withhold current,payload` compares those alike.",
    ]
    return lines
