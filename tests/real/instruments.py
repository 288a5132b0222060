"""Further instruments in real logs, beside the mapped signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
from ferryid.report.second_sources import lines, of_all
from ferryid.types import IN_MEMORY
from ferryid.vessel import load_profile
from tests.real.places import DATA

LOGS = {"milliampere-2025": "milliampere1", "vtec-usv": "vtec_usv/*.bag"}


def section(found: Mapping[str, Sequence[str]]) -> str:
    """Return the section on further instruments, from `sources`."""
    rows = [
        "\n## Other instruments\n",
        "Topics that the profile does not map, beside the mapped signals.",
        "",
    ]
    return "\n".join([*rows, *(f"- {vessel}: {text}" for vessel, texts in found.items() for text in texts)])


def sources() -> dict[str, list[str]]:
    """Return sentences on topics that the profile does not map, by profile."""
    made_of = {}
    for vessel, pattern in LOGS.items():
        logs = [str(path) for path in sorted(DATA.glob(pattern))]
        made = diagnose(logs, load_profile(vessel), DiagnosisSettings(), IN_MEMORY)
        found = of_all(made) or made[0].sources
        assert found is not None
        made_of[vessel] = [line.removeprefix("instrument: ") for line in lines(found)]
    return made_of
