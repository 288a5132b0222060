"""Changes between the logs of real campaigns: as they are, and with a propeller that is weakened by calculation."""

from __future__ import annotations

from dataclasses import dataclass

from ferryid.diagnose.inference.campaign import assemble
from ferryid.diagnose.inference.campaign_estimation import estimate_campaign
from ferryid.diagnose.inference.changes_between_logs import weigh_changes
from ferryid.diagnose.judging.campaign import judge_campaign
from ferryid.effects.wording import titled
from ferryid.types import no_progress
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile
from tests.real import esso
from tests.real.groups import weakened
from tests.real.places import DATA

FACTORS = (0.7, 0.8)


@dataclass(frozen=True)
class Case:
    """Logs in the order of their times, and the factor on the propeller's force that is concealed in the last of them."""

    what: str
    profile: Profile
    logs: list[str]
    factor: float = 1.0
    last: int = 0


def cases() -> list[Case]:
    """Return campaigns as they are, and the same with a propeller that weakens."""
    tanker, usv = load_profile("kvlcc2-model"), load_profile("vtec-usv")
    random, zigzag = esso.logs("random"), esso.logs("zigzag")
    runs, bags = (
        [str(path) for path in sorted((DATA / folder).glob(pattern))]
        for folder, pattern in (("kvlcc2", "*.dat"), ("vtec_usv", "*.bag"))
    )
    pond = ("Esso Osaka, random runs", esso.ESSO, random)
    tank = ("KVLCC2", tanker, runs)
    return [
        Case(*pond),
        Case("Esso Osaka, zigzags", esso.ESSO, zigzag),
        Case("Esso Osaka, all runs", esso.ESSO, [*random, *zigzag]),
        Case(*tank),
        Case("VTec S-III", usv, bags),
        *(Case(*one, factor, len(one[2]) // 2 + 1) for one in (pond, tank) for factor in FACTORS),
    ]


def row(case: Case) -> str:
    """Return what is found in a campaign as a row of a table."""
    count = len(case.logs)
    logs = [
        weakened(path, case.profile, case.factor if i >= count - case.last else 1.0) for i, path in enumerate(case.logs)
    ]
    assembled = assemble(logs, case.profile)
    assert assembled is not None
    campaign, place = assembled
    judged = judge_campaign(campaign, place, no_progress)
    # Beside what was found, no further change would be weighed.
    made = judged.hull.fit if judged.change is None else estimate_campaign(campaign)
    best = weigh_changes(estimate_campaign(made.campaign, noise=made.noise, begin=made))[0]
    what = titled(best.candidate.effect.title, best.candidate.instance)
    found = "" if judged.change is None else judged.change.says
    concealed = f"{case.factor:g} in the last {case.last}" if case.last else ""
    return (
        f"| {case.what} | {len(place)} | {concealed} | {what}, after {best.count}: {best.evidence:+.1f} nat | {found} |"
    )


def section() -> str:
    """Return the section on changes between logs."""
    return "\n".join(
        [
            "\n## Changes between logs\n",
            "A load or a loss of force that comes or goes between two logs of a campaign, as a diagnosis seeks it without "
            "being asked: wind of Esso Osaka measured, propeller weakened by calculation as above. *Likeliest* is the change "
            "and the number of logs before it that would add most evidence if gaps were linear in it and logs did not "
            "scatter; what is found must hold beside such a scatter, too.",
            "",
            "| campaign | logs | propeller's factor, concealed | likeliest | found |",
            "|---|---|---|---|---|",
            *(row(case) for case in cases()),
        ]
    )
