"""What a log speaks for: the weak form, whitening, likelihood, search and evidence."""

from ferryid.diagnose.inference.estimation import (
    Candidate,
    EstimationProblem,
    Fit,
    choose_parameters,
    estimation_problem,
    fit,
    fitted_force_model,
)
from ferryid.diagnose.inference.motion_responses import VAGUE, motion_responses
from ferryid.diagnose.inference.noise_estimation import fit_noise_with
from ferryid.diagnose.inference.noise_model import NoiseModel, likelihood
from ferryid.diagnose.inference.prior import prior_force_model
from ferryid.diagnose.inference.profile_likelihood import intervals
from ferryid.diagnose.inference.search import is_negligible
from ferryid.diagnose.inference.stochastic_disturbance import START_FREQUENCIES, START_STRENGTHS, DisturbanceState
from ferryid.diagnose.inference.thresholds import INFERENCE
from ferryid.diagnose.inference.weak_form import Windows, windows

__all__ = [
    "INFERENCE",
    "START_FREQUENCIES",
    "START_STRENGTHS",
    "VAGUE",
    "Candidate",
    "DisturbanceState",
    "EstimationProblem",
    "Fit",
    "NoiseModel",
    "Windows",
    "choose_parameters",
    "estimation_problem",
    "fit",
    "fit_noise_with",
    "fitted_force_model",
    "intervals",
    "is_negligible",
    "likelihood",
    "motion_responses",
    "prior_force_model",
    "windows",
]
