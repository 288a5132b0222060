"""Logs of one vessel, diagnosed together: read, and given one hull, before each is looked at by itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

import numpy as np

from ferryid.counts import counted
from ferryid.diagnose.checks import examine
from ferryid.diagnose.hypothesis import Suspect
from ferryid.diagnose.noise import ORDER
from ferryid.diagnose.scene import dimensions, plain_picture, scene_of, window_lengths
from ferryid.diagnose.shared_hull import INDUCED, Member, SharedHull, fit_together, induced_spread
from ferryid.diagnose.weak import Windows, windows
from ferryid.effects import effects
from ferryid.effects.picture import Picture
from ferryid.errors import FerryIdError
from ferryid.vessel.profile import Floats, Profile

FEWEST_WINDOWS = 4 * ORDER
"""Windows below which a log has no say."""
OWN = "wind"
"""What every log has its own of, where it can be told: the commonest of what a hull would otherwise take upon itself."""


@dataclass(frozen=True)
class Together:
    """Logs of one vessel and their common hull; `place` gives each path's place in it, for logs that have a say."""

    members: tuple[Member, ...]
    hull: SharedHull
    place: Mapping[str, int]

    def picture(self, path: str, plain: Picture) -> tuple[Picture, Floats]:
        """Return a log's picture with the hull that the other logs speak for, as `SharedHull.picture` does."""
        return self.hull.picture(plain, self.place.get(path))

    def says(self, path: str) -> str:
        """Return a sentence on where the hull comes from that a log is diagnosed with."""
        others = len(self.members) - (path in self.place)
        # Told as a ratio of standard deviations, which people have a feeling for; the hull's uncertainty is widened by it.
        apart = sqrt(self.hull.disagreement)
        agree = (
            f"They disagree about it {apart:.1f} times as much as the noise in them explains, and it was taken to be uncertain "
            "accordingly."
            if apart > 1.0
            else "They disagree about it by no more than the noise in them explains."
        )
        return f"The hull is that of {counted(others, 'other log')} of the vessel, lift included. {agree}"


def together(
    logs: Sequence[str],
    profile: Profile,
    out: Path | None,
    *,
    withhold: Sequence[str] = (),
    verify: bool = False,
    progress: Callable[[str], None],
) -> Together:
    """Read logs of one vessel and fit one hull to all of them, with a steady wind of its own to each that did not measure it.

    Parameters
    ----------
    logs, profile, out, withhold, verify, progress
        As in `ferryid.diagnose.diagnose.diagnose`.

    Raises
    ------
    FerryIdError
        For logs that cannot be used, and for fewer than two with enough in them.
    """
    members: list[Member] = []
    spreads: list[Floats] = []
    place: dict[str, int] = {}
    for path in logs:
        scene, _ = scene_of(path, profile, out, withhold=withhold, verify=verify, progress=progress)
        seen = windows(examine(scene)[1], *window_lengths(profile))
        if len(seen.starts) < FEWEST_WINDOWS or path in place:
            continue
        plain, spread = plain_picture(seen.scene, profile)
        place[path] = len(members)
        members.append(Member(seen, plain, own_of(seen, profile)))
        spreads.append(spread)
    if len(members) < 2:
        raise FerryIdError(
            f"--together: a common hull needs two logs of {profile.name} with a minute or more of motion each, found "
            f"{len(members)} of {len(logs)}. Fix: give more logs, or leave out --together"
        )
    progress(f"fitting one hull to {counted(len(members), 'log')}")
    length, _, draught = dimensions(profile)
    induced_size = np.zeros(len(INDUCED)) if profile.hull.has_model else induced_spread(length, draught)
    return Together(tuple(members), fit_together(members, np.max(spreads, axis=0), induced_size), place)


def own_of(seen: Windows, profile: Profile) -> tuple[Suspect, ...]:
    """Return what a log is given of its own while the hull is fitted to all."""
    effect = effects()[OWN]
    return () if effect.cannot(seen.scene) else (Suspect(effect, None, effect.parameters_of(profile)),)
