"""Section 5.3: how many components, and how long a smoothing window."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ferryid.identify.estimate import estimator
from ferryid.identify.judge import force_mse
from ferryid.identify.simpls import simpls, sse
from ferryid.report.drawing import Drawing, Line, Panel
from ferryid.reproduce.flight import Flight, controlled, fly, trial, weather_seed
from ferryid.reproduce.lab import Lab
from ferryid.reproduce.learning import BASE, THESIS, hull_alone, learn, products
from ferryid.reproduce.pictures import against
from ferryid.reproduce.study import Row, Study, Table, median, number, spread
from ferryid.signals.smooth import Measured, moving_mean, smooth_measured
from ferryid.signals.track import Motion
from ferryid.vessel.profile import Profile

Floats = NDArray[np.float64]

PLACE = 20
WINDOWS_S = (0.0, 0.25, 0.5, 1.0, 1.5)
"""The windows that the thesis tried."""
JUDGED_AT_S = 1.0
MOST = 21
TWELVE = 11
"""Index of the thesis's number of components."""
CLOSE = 1.02
"""An error within 2 % of the least counts as good as it."""


@dataclass(frozen=True)
class Outcome:
    """One seed: test errors, mean of the axes' MSE over the base model's.

    Attributes
    ----------
    scaled, unscaled
        Trained on Experiment 1 with the columns divided by their standard deviation and as they are, tested on Experiment 2;
        shape (windows, MOST).
    axes
        The first of these per axis with 12 components, shape (windows, 3).
    calm, white, given
        Calm weather, 12 components, shape (windows,): coloured noise; white noise of the same strength; and white noise on
        velocity and on an acceleration that is measured, not differentiated.
    """

    scaled: Floats
    unscaled: Floats
    axes: Floats
    calm: Floats
    white: Floats
    given: Floats
    drawings: tuple[Drawing, ...]


def study(lab: Lab) -> Study:
    """Sweep components and windows."""
    outcomes = lab.each_seed(_sweep, "tuning: components and windows")
    scaled = np.array([one.scaled for one in outcomes])
    unscaled = np.array([one.unscaled for one in outcomes])
    windows = scaled[:, :, TWELVE]
    fixed = WINDOWS_S.index(JUDGED_AT_S)
    rows = (
        Row("best number of components, window 1.0 s", "", 12.0, _components(scaled[:, fixed])),
        Row("fewest components within 2 % of the best, window 1.0 s", "", None, _fewest(scaled[:, fixed])),
        Row("the same without scaling the columns, best", "", None, _components(unscaled[:, fixed])),
        Row("the same without scaling the columns, fewest within 2 %", "", None, _fewest(unscaled[:, fixed])),
        Row("best window on logs with wind and waves", "s", 1.0, _window(windows)),
        Row("best window in calm simulation, coloured noise", "s", 0.25, _window(np.array([o.calm for o in outcomes]))),
        Row("best window in calm simulation, white noise", "s", 0.25, _window(np.array([o.white for o in outcomes]))),
        Row(
            "best window in calm simulation, white noise, acceleration measured",
            "s",
            0.25,
            _window(np.array([o.given for o in outcomes])),
        ),
    )
    table = Table(
        "Test error with 12 components by window: MSE over the base model's, mean of the axes; median (least to greatest).",
        ("window [s]", *(f"{window:g}" for window in WINDOWS_S)),
        tuple(
            (label, *(spread(values[:, k].tolist()) for k in range(len(WINDOWS_S))))
            for label, values in (
                ("wind and waves", windows),
                ("calm, coloured noise", np.array([one.calm for one in outcomes])),
                ("calm, white noise", np.array([one.white for one in outcomes])),
                ("calm, white noise, acceleration measured", np.array([one.given for one in outcomes])),
            )
        ),
    )
    return Study(
        "tuning",
        "Number of components and smoothing window (section 5.3)",
        "Which number of components and which window predict the force on another day best?",
        (
            "Trained on a round of Experiment 1 (wind), tested on one of Experiment 2 (breeze and waves), whose "
            "log is always "
            "smoothed at 1.0 s. Calm: two rounds of section 5.4, one to train, one to test.",
            "Table 5.2 lists noise on the acceleration beside noise on the velocity. Both at once can be read as "
            "coloured noise of "
            "the velocity, as here, or as white noise on two separate measurements; the third calm row does the latter.",
        ),
        rows,
        (table,),
        tuple(_findings(outcomes, scaled, unscaled)),
        (
            _curves("components", "Test error against the number of components, window by window.", scaled),
            against(
                "windows",
                "Test error against the window, 12 components: median and range over the seeds.",
                "window [s]",
                ("MSE / base model's",),
                WINDOWS_S,
                {
                    "wind and waves": windows[:, :, None],
                    "calm, coloured noise": np.array([one.calm for one in outcomes])[:, :, None],
                    "calm, white noise": np.array([one.white for one in outcomes])[:, :, None],
                    "calm, acceleration measured": np.array([one.given for one in outcomes])[:, :, None],
                },
                logarithmic=True,
            ),
            *outcomes[0].drawings,
        ),
        {
            "windows_s": list(WINDOWS_S),
            "scaled": np.median(scaled, axis=0).tolist(),
            "unscaled": np.median(unscaled, axis=0).tolist(),
            "per_axis_by_window": np.median([one.axes for one in outcomes], axis=0).tolist(),
        },
    )


def _components(curves: Floats) -> tuple[float, ...]:
    return tuple(float(np.argmin(curve) + 1) for curve in curves)


def _fewest(curves: Floats) -> tuple[float, ...]:
    return tuple(float(np.argmax(curve <= CLOSE * curve.min()) + 1) for curve in curves)


def _window(curves: Floats) -> tuple[float, ...]:
    return tuple(WINDOWS_S[int(np.argmin(curve))] for curve in curves)


def _sweep(folder: Path, seed: int) -> Outcome:
    training = fly(folder, "training", controlled(trial("experiment-1"), BASE), weather_seed(seed, 1))
    testing = fly(folder, "testing", controlled(trial("experiment-2"), BASE), weather_seed(seed, 4))
    profile, test = training.profile, testing.motion(JUDGED_AT_S)
    unit = force_mse(hull_alone(profile, BASE), test)
    judge = products([test], profile)
    scaled: list[Floats] = []
    unscaled: list[Floats] = []
    axes: list[Floats] = []
    for window in WINDOWS_S:
        source = products([training.motion(window)], profile)
        for scale, curves in ((True, scaled), (False, unscaled)):
            fitted = simpls(source, MOST, scale=scale)
            curves.append(np.mean(sse(judge, fitted.coefficients, fitted.intercepts) / judge.n / unit, axis=1))
            if scale:
                twelve = slice(TWELVE, TWELVE + 1)
                axes.append((sse(judge, fitted.coefficients[twelve], fitted.intercepts[twelve]) / judge.n / unit)[0])
    quiet = trial("calm")
    noise = replace(quiet.sensors.noise, white_share=1.0)
    white = replace(quiet, sensors=replace(quiet.sensors, noise=noise))
    coloured_pair = [fly(folder, f"calm-{k}", quiet, weather_seed(seed, 20 + k)) for k in (1, 2)]
    white_pair = [fly(folder, f"white-{k}", white, weather_seed(seed, 20 + k)) for k in (1, 2)]
    return Outcome(
        np.array(scaled),
        np.array(unscaled),
        np.array(axes),
        _by_window([_windowed(flight.measured) for flight in coloured_pair], profile),
        _by_window([_windowed(flight.measured) for flight in white_pair], profile),
        _by_window([_accelerometer(flight, seed) for flight in white_pair], profile),
        _pictures(training, testing) if seed == 1 else (),
    )


def _windowed(measured: Measured) -> dict[float, Motion]:
    return {window: smooth_measured(measured, window) for window in {*WINDOWS_S, JUDGED_AT_S}}


def _accelerometer(flight: Flight, seed: int) -> dict[float, Motion]:
    """Return the log as if the acceleration were measured, with the white noise of Table 5.2, and smoothed like the rest."""
    truth, noise = flight.simulation.truth, flight.simulation.scenario.sensors.noise
    motions = _windowed(flight.measured)
    t = flight.measured.t
    std = np.array([noise.acceleration_mps2, noise.acceleration_mps2, np.radians(noise.yaw_acceleration_degps2)])
    random = np.random.default_rng([seed, 5, 2])
    nu_dot = np.column_stack([np.interp(t, truth.t, column) for column in truth.nu_dot.T])
    nu_dot += std * random.standard_normal(nu_dot.shape)
    return {
        window: replace(motion, nu_dot=moving_mean(nu_dot, 2 * int(window * motion.rate_hz / 2) + 1))
        for window, motion in motions.items()
    }


def _by_window(pair: list[dict[float, Motion]], profile: Profile) -> Floats:
    training, testing = pair
    test = testing[JUDGED_AT_S]
    unit = force_mse(hull_alone(profile, BASE), test)
    errors = []
    for window in WINDOWS_S:
        model = learn([training[window]], profile, replace(THESIS, window_s=window))
        errors.append(float(np.mean(force_mse(model, test) / unit)))
    return np.array(errors)


def _pictures(training: Flight, testing: Flight) -> tuple[Drawing, ...]:
    """Return figures 5.1 and 5.2: surge on the test log, unsmoothed and smoothed, by models of two windows each."""
    drawings = []
    for name, judged, windows in (("5-1-test-unsmoothed", 0.0, (0.5, 0.0)), ("5-2-test-smoothed", 1.0, (1.5, 0.0))):
        test = testing.motion(judged)
        rows = (test.t >= 240.0) & (test.t <= 300.0) & test.valid
        panels = []
        for window in windows:
            model = learn([training.motion(window)], training.profile, replace(THESIS, window_s=window))
            panels.append(
                Panel(
                    "surge X [N]",
                    (
                        Line("model", test.t[rows], estimator(model).of(test)[rows, 0]),
                        Line("measured", test.t[rows], test.tau[rows, 0]),
                    ),
                    title=f"training log smoothed with {window:g} s",
                )
            )
        caption = (
            f"Predicted force on a test log smoothed with {judged:g} s, as in figure {name[:3].replace('-', '.')}."
        )
        drawings.append(Drawing(name, caption, "time [s]", tuple(panels)))
    return tuple(drawings)


def _curves(name: str, caption: str, values: Floats) -> Drawing:
    x = np.arange(1, MOST + 1, dtype=float)
    lines = tuple(
        Line(f"window {window:g} s", x, np.median(values[:, k], axis=0), marked=True)
        for k, window in enumerate(WINDOWS_S)
    )
    return Drawing(name, caption, "number of components", (Panel("MSE / base model's", lines, logarithmic=True),))


def _findings(outcomes: Sequence[Outcome], scaled: Floats, unscaled: Floats) -> list[str]:
    fixed = WINDOWS_S.index(JUDGED_AT_S)
    curve, bare = np.median(scaled[:, fixed], axis=0), np.median(unscaled[:, fixed], axis=0)
    told = [
        f"With 12 components the test error is {number(curve[TWELVE])} of the base model's (window 1.0 s), with the best "
        f"number, {int(np.argmin(curve)) + 1}, {number(float(curve.min()))}, and with all {number(float(curve[-1]))}: "
        + (
            "12 is as good as any."
            if curve[TWELVE] <= CLOSE * curve.min()
            else f"12 is {100 * (curve[TWELVE] / curve.min() - 1):.0f} % from the best."
        ),
        "Three pairs of the basis are the same function, so that components beyond the eighteenth add nothing.",
        f"Without dividing the columns by their standard deviation, as De Jong writes SIMPLS, the error with 12 "
        f"components is "
        f"{number(bare[TWELVE])} and the best number {int(np.argmin(bare)) + 1}. The thesis does not say which it does.",
    ]
    windows = np.array([one.scaled[:, TWELVE] for one in outcomes])
    best = Counter(_window(windows)).most_common()
    told.append(
        "On logs with wind and waves the best window is "
        + ", ".join(f"{window:g} s in {count}" for window, count in best)
        + f" of {len(outcomes)} runs; 1.0 s is "
        f"{100 * (median((windows[:, fixed] / windows.min(axis=1)).tolist()) - 1):.1f} % "
        "from the best (median)."
    )
    for label, values in (
        ("coloured noise of Table 5.2", np.array([one.calm for one in outcomes])),
        ("white noise", np.array([one.white for one in outcomes])),
        ("white noise and a measured acceleration", np.array([one.given for one in outcomes])),
    ):
        quarter = WINDOWS_S.index(0.25)
        loss = 100 * (median((values[:, quarter] / values.min(axis=1)).tolist()) - 1)
        told.append(
            f"Calm, {label}: best window {spread(_window(values), 's')}; 0.25 s is {loss:.1f} % from the best (median)."
        )
    return told
