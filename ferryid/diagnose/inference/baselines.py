"""What recordings are compared with: see `ferryid.diagnose.inference.stages.Baseline`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.data.path_comparison import PathComparison, compare_paths
from ferryid.diagnose.inference.campaign import CommonHull
from ferryid.diagnose.inference.campaign_properties import properties_of
from ferryid.diagnose.inference.estimation import Candidate
from ferryid.diagnose.inference.needed_correction import note_on_light_hull
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.search import list_candidates
from ferryid.diagnose.inference.simulation_baseline import (
    Simulation,
    difference_notes,
    differing_candidates,
    simulated_force_model,
    simulation_as_json,
)
from ferryid.diagnose.inference.stages import AveragedLog, Expectation
from ferryid.models import Model
from ferryid.vessel.profile import Profile


@dataclass(frozen=True)
class HullBaseline:
    """The profile's hull, or a fitted model."""

    profile: Profile
    model: Model | None = None
    joint: bool = False
    hull_logs: int = 1
    updates_model: bool = True

    @property
    def hull_known(self) -> bool:
        """True where the profile has a hull model that estimates may lean on, or there is a fitted one."""
        return self.model is not None or self.profile.hull.is_known

    @property
    def sensors(self) -> Mapping[str, Mapping[str, Estimate]]:
        """None."""
        return {}

    def expect(self, log: AveragedLog) -> Expectation:
        """Return the forces of the hull, in still air and water where none was measured."""
        windows = log.windows
        sha256 = log.screened.measured.survey.recording.sha256
        return Expectation(*prior_force_model(windows.measurements, self.profile, self.model, sha256), _library(log))


@dataclass(frozen=True)
class SimulationBaseline:
    """A simulation of the same trial, with what was learnt from its log."""

    simulated: Simulation
    joint: bool = False
    hull_logs: int = 1
    updates_model: bool = False

    @property
    def hull_known(self) -> bool:
        """True where the profile has a hull model that estimates may lean on."""
        return self.simulated.measurements.profile.hull.is_known

    @property
    def sensors(self) -> Mapping[str, Mapping[str, Estimate]]:
        """Errors of the simulated sensors."""
        return {one.effect: one.parameters for one in self.simulated.sensors}

    def expect(self, log: AveragedLog) -> Expectation:
        """Return the simulation's forces, with its own conditions as neutral values of the candidates."""
        measurements, windows = log.screened.measurements, log.windows
        path_errors = compare_paths(self.simulated.measurements, measurements)
        shift_s = path_errors.shift_s if isinstance(path_errors, PathComparison) else 0.0
        comparison = simulation_as_json(self.simulated, path_errors)
        return Expectation(
            *simulated_force_model(self.simulated, windows.measurements, shift_s),
            tuple(differing_candidates(self.simulated, windows.measurements, shift_s)),
            (comparison["says"], *difference_notes(self.simulated, measurements)),
            comparison,
        )


@dataclass(frozen=True)
class CampaignBaseline:
    """One hull for all logs of a campaign; each is compared with what the others say of it, in its own conditions."""

    profile: Profile
    hull: CommonHull
    model: Model | None = None
    joint: bool = True
    updates_model: bool = True

    @property
    def hull_known(self) -> bool:
        """True where the profile has a hull model that estimates may lean on, or there is a fitted one."""
        return self.model is not None or self.profile.hull.is_known

    @property
    def hull_logs(self) -> int:
        """Logs that its hull was fitted to, references among them."""
        return len(self.hull.place)

    @property
    def sensors(self) -> Mapping[str, Mapping[str, Estimate]]:
        """None."""
        return {}

    def expect(self, log: AveragedLog) -> Expectation:
        """Return the forces of the hull that the other logs speak for; conditions are judged over all logs, not here."""
        sha256 = log.screened.measured.survey.recording.sha256
        plain, _ = prior_force_model(log.windows.measurements, self.profile, self.model, sha256)
        force_model, spread = self.hull.force_model(log.path, plain)
        lasting = {one.key for one in properties_of(self.hull.fit.campaign)}
        # What only lasts is the campaign's to judge; what may begin in one log is looked for there as well.
        library = tuple(
            one for one in _library(log) if not one.effect.of_log and (one.key not in lasting or one.effect.onset)
        )
        light = () if self.model is not None else note_on_light_hull(self.profile)
        return Expectation(force_model, spread, library, (*light, self.hull.says(log.path)))


def _library(log: AveragedLog) -> tuple[Candidate, ...]:
    return tuple(list_candidates(log.windows.measurements)[0])
