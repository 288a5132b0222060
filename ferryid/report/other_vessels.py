"""What finds, among several logs of a fit or a sweep, those of another vessel."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ferryid.types import RunContext
from ferryid.vessel.profile import Profile


def other_vessels(
    profile: Profile, run: RunContext
) -> Callable[[Sequence[str]], tuple[Mapping[str, str], tuple[str, ...]]]:
    """Return what a fit asks for logs of another vessel, as of `ferryid.identify.fit_logs`."""

    def find(paths: Sequence[str]) -> tuple[Mapping[str, str], tuple[str, ...]]:
        # One log has no need of what diagnoses are made with, which takes a while to import.
        from ferryid.diagnose import find_other_vessels

        return find_other_vessels(paths, profile, run)

    return find
