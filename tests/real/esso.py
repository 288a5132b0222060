"""Esso Osaka with the wind withheld: what a common hull of several runs tells of each run's wind, and its controls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.diagnose.checks import examine
from ferryid.diagnose.data.measurements import read_measurements, window_lengths
from ferryid.diagnose.inference.campaign import fit_campaign
from ferryid.diagnose.inference.campaign_hull import CampaignHull, Member, fit_campaign_hull, induced_spread
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.weak_form import windows
from ferryid.effects.effect import Parameter
from ferryid.effects.force_model import COEFFICIENTS, ForceModel
from ferryid.signals.smooth import moving_mean
from ferryid.vessel import load_profile
from ferryid.vessel.wind import wind_force
from tests.diagnose.trials import averaged
from tests.real.campaign_evidence import Gains, held_out_gains, placebos, turn_heading
from tests.real.places import DATA

Floats = NDArray[np.float64]

ESSO = load_profile("esso-osaka")
assert ESSO.wind is not None
AREAS = ESSO.wind
FOUND, MEASURED, MEAN = "found", "measured", "mean of the measured"
NODES_S, MEMORY_S, GUST_MPS = 15.0, 30.0, 1.0
"""A wind in the course of time: its nodes, and what is believed of its changes."""


def logs(kind: str) -> list[str]:
    """Return the runs of one kind, random or zigzag."""
    return [str(path) for path in sorted((DATA / "esso_osaka" / kind).glob("*.csv"))]


@dataclass(frozen=True)
class Winds:
    """Winds of runs under one hypothesis, shape (runs, 2), with standard errors."""

    values: Floats
    errors: Floats

    def turned(self, measured: Floats) -> Floats:
        """Return how far they point away from the measured ones [deg], shape (runs,)."""
        apart = bearing(self.values) - bearing(measured)
        return np.abs((apart + 180.0) % 360.0 - 180.0)

    def strength(self, measured: Floats) -> Floats:
        """Return their strength over that of the measured ones, shape (runs,)."""
        return np.hypot(*self.values.T) / np.hypot(*measured.T)


@dataclass(frozen=True)
class Study:
    """What was found of the wind in runs of one kind.

    Attributes
    ----------
    names
        Of the runs.
    measured
        Mean of the hidden channel, and its standard deviation over time; shapes (runs, 2).
    winds
        By hypothesis: found, and the controls.
    disagreement
        Of the runs about the hull.
    gains
        Held-out, by hypothesis; empty where not judged.
    """

    names: tuple[str, ...]
    measured: Floats
    unsteady: Floats
    winds: dict[str, Winds]
    disagreement: float
    gains: dict[str, Gains]


@dataclass(frozen=True)
class Course:
    """The wind in the course of time in one run: times, found and hidden (as steady as the nodes), shapes (n,), (n, 2)."""

    t: Floats
    found: Floats
    hidden: Floats


def study(kind: str, *, judged: bool) -> tuple[Study, list[Member], list[Floats]]:
    """Fit runs together with the wind hidden, and with controls in its place; hold out where `judged`."""
    paths = logs(kind)
    joint = fit_campaign(averaged(paths, ESSO, withhold=("wind",)), ESSO, lambda stage: None)
    kept = sorted(joint.place, key=lambda path: joint.place[path])
    members = list(joint.members)
    hidden = [hidden_wind(path, member) for path, member in zip(kept, members, strict=True)]
    usable = [wind[member.windows.measurements.usable] for wind, member in zip(hidden, members, strict=True)]
    spread, induced_size = np.split(joint.hull.spread, [len(COEFFICIENTS)])
    controls = placebos(members)
    winds = {FOUND: winds_of(joint.hull)}
    winds |= {name: winds_of(fit_campaign_hull(group, spread, induced_size)) for name, group in controls.items()}
    gains: dict[str, Gains] = {}
    if judged:
        bare = [replace(member, candidates=()) for member in members]
        variants: dict[str, Sequence[Member]] = {FOUND: members, **controls}
        variants[MEASURED] = [blown(member, wind) for member, wind in zip(bare, hidden, strict=True)]
        variants[MEAN] = [
            blown(member, np.broadcast_to(rows.mean(axis=0), wind.shape))
            for member, wind, rows in zip(bare, hidden, usable, strict=True)
        ]
        gains = held_out_gains(variants, bare, spread, induced_size)
    made = Study(
        names=tuple(Path(path).stem for path in kept),
        measured=np.array([rows.mean(axis=0) for rows in usable]),
        unsteady=np.array([rows.std(axis=0) for rows in usable]),
        winds=winds,
        disagreement=joint.hull.disagreement,
        gains=gains,
    )
    return made, members, hidden


def hidden_wind(path: str, member: Member) -> Floats:
    """Return the wind that a run measured, on the rows of its windows' measurements, shape (n, 2)."""
    measurements, _ = read_measurements(path, ESSO)
    corrected = windows(
        replace(examine(replace(measurements, wind=None))[1], wind=measurements.wind), *window_lengths(ESSO)
    ).measurements
    assert corrected.wind is not None
    assert np.allclose(corrected.t, member.windows.measurements.t)
    return corrected.wind


def blown(member: Member, wind: Floats) -> Member:
    """Return a run in whose force model a wind blows, shape (n, 2)."""
    measurements = member.windows.measurements
    return replace(
        member, plain=replace(member.plain, external=wind_force(AREAS, wind, measurements.psi, measurements.nu))
    )


def winds_of(hull: CampaignHull) -> Winds:
    """Return the winds of all runs."""
    return Winds(np.array([one[0] for one in hull.values]), np.array([one[0] for one in hull.errors]))


def courses(members: Sequence[Member], hidden: Sequence[Floats], spread: Floats, *, mirrored: bool) -> list[Course]:
    """Fit all runs together with a wind that changes in the course of time, on true or mirrored headings."""
    varying, series = zip(*(changing(member) for member in members), strict=True)
    group = [
        replace(member, candidates=(turn_heading(one, -member.windows.measurements.psi) if mirrored else one,))
        for member, one in zip(members, varying, strict=True)
    ]
    made = fit_campaign_hull(group, *np.split(spread, [len(COEFFICIENTS)]))
    told = []
    for member, wind, values, of in zip(members, hidden, made.values, series, strict=True):
        measurements = member.windows.measurements
        rows = 2 * round(0.5 * NODES_S / measurements.step_s) + 1
        steady = moving_mean(np.pad(wind, ((rows // 2, rows // 2), (0, 0)), mode="edge"), rows)[
            rows // 2 : -(rows // 2)
        ]
        told.append(Course(measurements.t, of @ values[0].reshape(2, -1).T, steady))
    return told


def correlation(told: Sequence[Course]) -> Floats:
    """Return the correlation of found and hidden wind within runs, each run's means taken out: north, east."""
    found, hidden = (np.vstack([part - part.mean(axis=0) for part in parts]) for parts in _both(told))
    return np.sum(found * hidden, axis=0) / np.sqrt(np.sum(found**2, axis=0) * np.sum(hidden**2, axis=0))


def _both(told: Sequence[Course]) -> tuple[list[Floats], list[Floats]]:
    return [one.found for one in told], [one.hidden for one in told]


def changing(member: Member) -> tuple[Candidate, Floats]:
    """Return a wind that changes as a first-order process does, and the matrix from its parameters to its course.

    Parameters are the mean and independent numbers of unit variance, north first; the matrix is (rows, parameters / 2).
    """
    t = member.windows.measurements.t
    nodes = np.arange(t[0], t[-1] + NODES_S, NODES_S)
    covariance = GUST_MPS**2 * np.exp(-np.abs(nodes[:, None] - nodes) / MEMORY_S)
    root = np.linalg.cholesky(covariance + 1e-9 * np.eye(len(nodes)))
    between = np.column_stack([np.interp(t, nodes, column) for column in root.T])
    series = np.column_stack([np.ones(len(t)), between])
    wind = member.candidates[0]
    mean = wind.parameters
    parameters = []
    for parameter in mean:
        parameters += [parameter, *(Parameter(f"{parameter.name} {k}", "-", 1.0, -9.0, 9.0) for k in range(len(nodes)))]

    def apply(force_model: ForceModel, p: Floats, instance: str | None) -> ForceModel:
        measurements = force_model.measurements
        air = series @ p.reshape(2, -1).T
        still = wind_force(AREAS, np.zeros_like(air), measurements.psi, measurements.nu)
        return replace(
            force_model,
            external=force_model.external + wind_force(AREAS, air, measurements.psi, measurements.nu) - still,
        )

    return replace(wind, effect=replace(wind.effect, apply=apply), parameters=tuple(parameters)), series


def bearing(wind: Floats) -> Floats:
    """Return where winds go to [deg], shape (runs,)."""
    return np.degrees(np.arctan2(wind[:, 1], wind[:, 0])) % 360.0


def spread_of(members: Sequence[Member]) -> Floats:
    """Return what is believed of the hull of these runs before them, induced drag included, shape (h,)."""
    coefficients = np.max([prior_force_model(one.windows.measurements, ESSO)[1] for one in members], axis=0)
    return np.concatenate([coefficients, induced_spread(ESSO.hull.length_m, ESSO.hull.draught_m)])
