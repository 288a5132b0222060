"""Differences between groups of real logs, as they are and with a propeller that is weakened by calculation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ferryid.diagnose.checks.screening import screen_sensors
from ferryid.diagnose.data.measurements import measure_log
from ferryid.diagnose.inference.campaign import assemble
from ferryid.diagnose.inference.group_differences import GROUPS, in_groups
from ferryid.diagnose.inference.stages import AveragedLog, average
from ferryid.diagnose.judging.group_differences import JudgedGroups, judge_groups
from ferryid.effects import effects
from ferryid.effects.force_model import hull_of
from ferryid.effects.measurements import hull_force_model
from ferryid.types import IN_MEMORY, no_progress
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile
from tests.real import esso
from tests.real.places import DATA

FACTORS = (0.7, 0.8, 0.9)


@dataclass(frozen=True)
class Case:
    """Two groups of logs, and the factor on the propeller's force in the second that is concealed by calculation."""

    what: str
    profile: Profile
    groups: tuple[list[str], list[str]]
    factor: float = 1.0


def cases() -> list[Case]:
    """Return groups that should be alike, and the same with a weakened propeller."""
    tanker = load_profile("kvlcc2-model")
    random, zigzag = esso.logs("random"), esso.logs("zigzag")
    runs = [str(DATA / "kvlcc2" / f"HSVA_CPMC_KVLCC2_Z_20_10_{side}.dat") for side in "PS"]
    alternate = (random[::2], random[1::2])
    alike = [
        Case("Esso Osaka, random runs, first against last", esso.ESSO, (random[:5], random[5:])),
        Case("Esso Osaka, random runs, every other", esso.ESSO, alternate),
        Case("Esso Osaka, zigzags, every other", esso.ESSO, (zigzag[::2], zigzag[1::2])),
        Case("Esso Osaka, random runs against zigzags", esso.ESSO, (random, zigzag)),
        Case("KVLCC2, port against starboard", tanker, ([runs[0]], [runs[1]])),
    ]
    weak = [replace(alike[1], factor=one) for one in FACTORS]
    return [*alike, *weak, replace(alike[4], factor=0.8)]


def judged(case: Case) -> JudgedGroups:
    """Compare the groups as ``diagnose --versus`` does."""
    logs = [
        (weakened(path, case.profile, case.factor if group == GROUPS[1] else 1.0), group)
        for group, paths in zip(GROUPS, case.groups, strict=True)
        for path in paths
    ]
    assembled = assemble([log for log, _ in logs], case.profile)
    assert assembled is not None
    campaign, place = assembled
    group_of = {log.path: group for log, group in logs}
    return judge_groups(
        in_groups(campaign, [group_of[path] for path in sorted(place, key=place.__getitem__)]), no_progress
    )


def weakened(path: str, profile: Profile, factor: float) -> AveragedLog:
    """Return a log whose recorded thrust is so large that what truly acted is a factor of it; rudders felt what acted."""
    screened = screen_sensors(measure_log(path, profile, IN_MEMORY), no_progress)
    seen = screened.measurements
    recorded = hull_force_model(seen, hull_of(profile))
    for name in seen.names:
        recorded = effects()["thruster_gain"].apply(recorded, np.array([1.0 / factor]), name)
    rudders = None if seen.rudders is None else seen.rudders * (1.0 / factor, 1.0)
    return average(replace(screened, measurements=replace(seen, parts=recorded.parts, rudders=rudders)))


def section() -> str:
    """Return the section on groups of logs."""
    rows = []
    for case in cases():
        found = judged(case)
        named = [one.says for one in found.differences]
        rows.append(f"| {case.what} | {case.factor:g} | {found.verdict} | {' '.join(named)} |")
    return "\n".join(
        [
            "\n## Differences between groups\n",
            "As `ferryid diagnose A... --versus B...` judges them, wind of Esso Osaka measured. A *factor* other than 1 is "
            "that of the propeller's thrust in B relative to A, concealed by calculation: the recorded thrust is larger by its "
            "inverse, and the rudder's force follows it, while the motion stays as it was.",
            "",
            "| groups | factor | verdict | differences of the vessel |",
            "|---|---|---|---|",
            *rows,
        ]
    )
