"""``make real``: fits and diagnoses of the recordings, written to reports/real.md and reports/real.

``python -m tests.real fits`` or ``diagnoses`` makes one of the two, and ``osaka``, ``milliampere`` or ``gunnerus`` one section
of the diagnoses. ``campaign`` (``make campaign``) writes reports/campaign.md. Where the recordings are absent nothing is
written.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial

from tests.real import campaign, diagnoses, fits
from tests.real.places import DATA, FOLDER

PARTS: dict[str, Callable[[], None]] = {"fits": fits.write, "diagnoses": diagnoses.write}
SECTIONS: dict[str, Callable[[], None]] = {
    "osaka": partial(diagnoses.write_again, diagnoses.osaka),
    "milliampere": partial(diagnoses.write_again, diagnoses.milliampere),
    "gunnerus": partial(diagnoses.write_again, diagnoses.gunnerus),
}
APART: dict[str, Callable[[], None]] = {"campaign": campaign.write}
"""Made only where it is asked for."""


def main(chosen: list[str]) -> None:
    """Write the parts that were asked for, or all."""
    if not DATA.is_dir():
        sys.exit(f"{DATA}: no recordings here. Fix: lay them beside the project, or leave reports/real as it is")
    made = {**PARTS, **SECTIONS, **APART}
    unknown = [name for name in chosen if name not in made]
    if unknown:
        sys.exit(f"{unknown[0]}: no part of the report. Fix: choose of {', '.join(made)}")
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in chosen or PARTS:
        made[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
