"""``make real``: fits and diagnoses of the recordings, written to reports/real.md and reports/real.

``python -m tests.real fits`` or ``diagnoses`` makes one of the two, and ``milliampere`` one section of the diagnoses. Where the
recordings are absent nothing is written.
"""

from __future__ import annotations

import sys
from functools import partial

from tests.real import diagnoses, fits
from tests.real.places import DATA, FOLDER

PARTS = {"fits": fits.write, "diagnoses": diagnoses.write}
SECTIONS = {"milliampere": partial(diagnoses.write_again, diagnoses.milliampere)}


def main(chosen: list[str]) -> None:
    """Write the parts that were asked for, or all."""
    if not DATA.is_dir():
        sys.exit(f"{DATA}: no recordings here. Fix: lay them beside the project, or leave reports/real as it is")
    made = {**PARTS, **SECTIONS}
    unknown = [name for name in chosen if name not in made]
    if unknown:
        sys.exit(f"{unknown[0]}: no part of the report. Fix: choose of {', '.join(made)}")
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name in chosen or PARTS:
        made[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
