"""How much the recorded forces tell of what disturbs the motion: the feedback from motion to orders, in nats.

A delay or lag that is not there explains a disturbance out of the forces. Forces can tell of a disturbance only what a
controller put in them, as nothing that is ordered makes the wind blow: the information that two series share is that which
flows from one to the other and that which flows back, and here nothing flows back. In expectation a false delay or lag
therefore gains no more than the feedback holds, and where that is shown to be less than was gained, feedback is not the cause.

The feedback of a log is the log-likelihood that past prediction errors of the motion gain in a prediction of the forces by
their own past; see `ferryid.signals.feedback`. The errors are those of the filter, white where the noise is
right, so that chance has a known variance.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import inf, sqrt

from ferryid.diagnose.inference.estimation import EstimationProblem, Fit, fitted_force_model
from ferryid.diagnose.inference.noise_estimation import excerpt, fit_noise
from ferryid.diagnose.inference.noise_model import make_whitening_filter
from ferryid.diagnose.inference.weak_form import Windows
from ferryid.effects.force_model import ForceModel
from ferryid.signals.feedback import Feedback, directed_information
from ferryid.types import Floats


def joined(every: Iterable[Feedback]) -> Feedback:
    """Return the feedback of several logs together."""
    all_logs = list(every)
    return Feedback(sum(one.nats for one in all_logs), sqrt(sum(one.error**2 for one in all_logs)))


def feedback_of(problem: EstimationProblem, made: Fit) -> Feedback:
    """Return the feedback of a log, with the prediction errors that a fit leaves under the problem's noise."""
    force_model = fitted_force_model(problem.plain, made)
    return _feedback(problem.steps, force_model, problem.white(force_model))


def feedback_beside(windows: Windows, force_model: ForceModel) -> Feedback:
    """Return the feedback of a log, with the errors that a force model leaves and the noise that is likeliest for them."""
    steps = windows.steps
    if not steps.runs:
        return Feedback(0.0, inf)
    few = excerpt(steps)
    ready = make_whitening_filter(fit_noise(few, few.gap(force_model)), steps)
    return _feedback(steps, force_model, ready.white(steps.gap(force_model)))


def _feedback(steps: Windows, force_model: ForceModel, white: Floats) -> Feedback:
    errors = steps.along_vessel(white.reshape(len(steps.starts), -1))
    return directed_information(errors, steps.mean(force_model.parts.sum(axis=1)), steps.runs)
