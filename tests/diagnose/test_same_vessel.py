"""Whether the logs of a fit are of one vessel: which are left out, which stay with a sentence, and none of one vessel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from ferryid.diagnose import same_vessel
from ferryid.diagnose.gathering import Sides
from ferryid.diagnose.inference.stages import AveragedLog
from ferryid.diagnose.judging.campaign_evidence import Gain
from ferryid.diagnose.judging.campaign_split import HullDistance, Split
from ferryid.diagnose.judging.changes_between_logs import ChangeTest
from ferryid.diagnose.same_vessel import find_other_vessels
from ferryid.types import IN_MEMORY
from ferryid.vessel import load_profile
from tests.diagnose.judging.test_campaign_split import renamed
from tests.diagnose.trials import FERRY

APART = Split(np.array([True]), Gain(200.0, 100.0, 300.0), 1.7, HullDistance(90.0, 5.0, 0.7))
LESS = replace(APART, ratio=3.0, hulls=HullDistance(90.0, 5.0, 0.3))
WEAK = cast(
    ChangeTest,
    SimpleNamespace(
        says="thruster1 gave 50 % of the force that it had in the 3 other logs: in d alone.", confirmed=True
    ),
)


@pytest.fixture
def parting(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """What makes logs fall into parts: each pair of a split and the paths of its smaller part, one after the other."""

    def log(path: str) -> AveragedLog:
        measured = SimpleNamespace(path=path, measurements=None)
        return cast(AveragedLog, SimpleNamespace(path=path, screened=SimpleNamespace(measured=measured)))

    monkeypatch.setattr(same_vessel, "measure_log", lambda path, *_: log(path).screened.measured)
    monkeypatch.setattr(same_vessel, "screen_sensors", lambda measured, _: SimpleNamespace(measured=measured))
    monkeypatch.setattr(same_vessel, "average", lambda screened: log(screened.measured.path))
    monkeypatch.setattr(same_vessel, "with_common_sensors", lambda logs: logs)

    def parts(*found: tuple[Split, str]) -> None:
        first = list(found[:1])

        def sides(logs: Sequence[AveragedLog], *_: object) -> Sides | None:
            left = {one.path for one in logs}
            # Without the sensors' corrections the same is found first.
            every = [*first, *found]
            first.clear()
            for split, inside in every:
                if set(inside) <= left:
                    return Sides(split, frozenset(inside), frozenset(left - set(inside)))
            return None

        monkeypatch.setattr(same_vessel, "sides_of", sides)

    return parts


def test_logs_of_one_vessel_are_all_used(parting: Callable[..., None]) -> None:
    parting()
    assert find_other_vessels("abcd", FERRY, IN_MEMORY) == ({}, ())


def test_logs_whose_hulls_are_apart_are_left_out_one_after_the_other(parting: Callable[..., None]) -> None:
    parting((APART, "d"), (APART, "ef"))
    foreign, doubts = find_other_vessels("abcdef", FERRY, IN_MEMORY)
    assert (sorted(foreign), doubts) == (["d", "e", "f"], ())
    assert foreign["d"].startswith(
        "no common hull fits it and the 5 other logs (held-out squared force error with one hull"
    )
    assert foreign["d"].endswith(
        "another vessel, or its hull changed. Fix: fit it by itself, with the profile of its vessel"
    )
    assert foreign["e"].startswith(
        "no common hull fits it and 1 log like it on one side and the 3 other logs on the other ("
    )


@pytest.mark.parametrize(
    ("split", "inside", "left_out"),
    [
        (LESS, "d", True),
        # A load or a weak thruster is in a log of the same vessel.
        (replace(LESS, change=WEAK), "d", False),
        # The hull may have changed.
        (LESS, "de", False),
        # Nobody knows which half is foreign.
        (APART, "def", False),
    ],
)
def test_logs_stay_where_nobody_knows_that_they_are_another_vessels(
    parting: Callable[..., None], split: Split, inside: str, left_out: bool
) -> None:
    parting((split, inside))
    foreign, doubts = find_other_vessels("abcdef", FERRY, IN_MEMORY)
    assert sorted(foreign) == (list(inside) if left_out else [])
    if left_out:
        assert doubts == ()
        return
    (said,) = doubts
    assert said.startswith("No common hull fits d")
    assert "All of them are used" in said
    assert ("thruster1 gave 50 % of the force" in said) == (split.change is not None)
    assert "ferryid diagnose OTHERS... --versus LOG..." in said


@pytest.mark.slow
def test_recorded_logs_of_another_tanker_are_left_out(shared_data: Callable[[str], Path], tmp_path: Path) -> None:
    profile = load_profile("esso-osaka")
    own = [str(one) for one in sorted(shared_data("esso_osaka/random").glob("*.csv"))]
    tanks = sorted(shared_data("kvlcc2").glob("*.dat"))[:2]
    foreign = [renamed(one, tmp_path / f"{one.stem}.csv") for one in tanks]
    found, doubts = find_other_vessels([own[0], *foreign, *own[1:]], profile, IN_MEMORY)
    assert (sorted(found), doubts) == (sorted(foreign), ())
    assert find_other_vessels(own, profile, IN_MEMORY) == ({}, ())
