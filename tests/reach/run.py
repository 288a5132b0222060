"""One run: simulate, write the log, read and diagnose it."""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.signal import welch

from ferryid.diagnose.diagnose import diagnose
from ferryid.diagnose.result import to_json
from ferryid.errors import FerryIdError
from ferryid.simulate import Simulation, simulate, write_log
from tests.reach.draw import Draw
from tests.reach.outside import PROFILES
from tests.reach.places import PLACES


def run(draw: Draw) -> dict[str, Any]:
    """Return what the diagnosis of one trial says, as plain data; ``seconds`` is how long the diagnosis took.

    The log is written and read like any other. Nothing of the draw reaches the diagnosis but that log, and the profile.
    """
    place = PLACES[draw.place]
    with TemporaryDirectory(prefix="ferryid-reach-") as name:
        folder = Path(name)
        if draw.series:
            (folder / "wind.csv").write_text(draw.series, encoding="utf-8")
        log = folder / "trial.mcap"
        trial = simulate(place.scenario(draw.tables, folder), draw.seed)
        write_log(trial, log)
        profile = PROFILES[draw.profile](place.profile, draw.size)
        start = time.perf_counter()
        try:
            found = diagnose([str(log)], profile, None, progress=lambda stage: None)[0]
        except FerryIdError as error:
            return {"error": str(error), "seconds": time.perf_counter() - start, "findings": [], "verdict": "refused"}
        seconds = time.perf_counter() - start
    told = to_json(found)
    return {
        "verdict": told["verdict"],
        "findings": [
            {
                key: one[key]
                for key in ("effect", "instance", "probability", "parameters", "improvement", "unresolved_with")
            }
            | {"onset": one["where"]["onset"], "offset": one["where"]["offset"], "rivals": one["rivals"][:2]}
            for one in told["findings"]
        ],
        "notes": told["notes"],
        "seconds": seconds,
        "acted": {"waves": waves_of(trial)} if any(truth.effect == "waves" for truth in draw.truths) else {},
    }


def waves_of(trial: Simulation) -> dict[str, float]:
    """Return what the waves of a trial did to the vessel: a scenario says how high the sea is, not how it pushes.

    The frequency is the mean of the moment's spectrum; a hull of the waves' length feels shorter ones in yaw than in sway.
    """
    X, Y, N = trial.truth.wave.T
    frequency, power = welch(N, 1.0 / float(trial.truth.t[1] - trial.truth.t[0]), nperseg=min(len(N), 4096))
    return {
        "peak_frequency": float((frequency * power).sum() / power.sum()),
        "force_std": float(np.sqrt(0.5 * (X.var() + Y.var()))),
        "moment_std": float(N.std()),
    }
