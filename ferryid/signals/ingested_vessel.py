"""Whose logs were ingested to an output folder."""

from __future__ import annotations

from pathlib import Path

from ferryid.errors import FerryIdError
from ferryid.signals import cache
from ferryid.vessel import VesselChoice, stated_choice
from ferryid.vessel.choice import named_profiles


def ingested_vessel(out: Path) -> VesselChoice:
    """Return the vessel of the logs that were ingested: what is stated above the folder, or else the one they were read with.

    Raises
    ------
    FerryIdError
        Where none or several were ingested, or the profile is neither beside the logs nor one that has a name.
    """
    stated = stated_choice([str(out)])
    if stated is not None:
        return stated
    kept = [note for _, note in sorted(cache.recordings(out).items())]
    hashes = {note["recording"]["profile_sha256"]: note["recording"]["profile_name"] for note in kept}
    known = {profile.sha256: (name, profile) for name, profile in named_profiles()[0].items()}
    for file in sorted({file[0] for note in kept for file in note["files"]}):
        beside = stated_choice([file], environment=False)
        if beside is not None:
            known.setdefault(beside.profile.sha256, (beside.reference, beside.profile))
    found = [known[one] for one in hashes if one in known]
    if len(found) == 1 and len(hashes) == 1:
        reference, profile = found[0]
        return VesselChoice(profile, reference, f"vessel {profile.name}: the one that was ingested to {out}")
    names = ", ".join(sorted(set(hashes.values()))) or "none"
    raise FerryIdError(
        f"{out / 'logs'}: the ingested logs do not decide the vessel, found {names}. Fix: give --vessel a profile's name or a "
        "TOML file"
    )
