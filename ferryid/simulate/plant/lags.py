"""First-order lags, advanced exactly over a step."""

from __future__ import annotations

from math import exp

from ferryid.compiled import borrowing

Weights = tuple[float, float, float, float]
"""What is kept of the old value, then the weights of the input at start, middle and end of a step."""


@borrowing
def follow(value: float, order: float, lag_s: float, rate_limit: float, h: float, decay: float) -> float:
    """Return where a first-order lag with a rate limit stands after `h` seconds of a constant order; exact.

    Far from the order it moves at `rate_limit` [unit/s], and from ``rate_limit * lag_s`` on it decays exponentially.
    `decay` is ``exp(-h / lag_s)``, 0 without a lag, so that the usual case needs no exponential.
    """
    error = order - value
    knee = rate_limit * lag_s
    if abs(error) > knee:
        straight_s = (abs(error) - knee) / rate_limit
        if straight_s >= h:
            return value + (rate_limit if error > 0.0 else -rate_limit) * h
        if lag_s == 0.0:
            return order
        return order - (knee if error > 0.0 else -knee) * exp((straight_s - h) / lag_s)
    return order - error * decay


def decay_of(lag_s: float, h: float) -> float:
    """Return ``exp(-h / lag_s)``, 0 without a lag."""
    return exp(-h / lag_s) if lag_s > 0.0 else 0.0


def lag_weights(lag_s: float, h: float, share: float) -> Weights:
    """Return how a lag without limits stands after `share` of a step of `h` seconds, for an input known at three points.

    The input is the parabola through its values at start, middle and end of the step, for which this is exact.
    """
    if lag_s == 0.0:
        return (0.0, 0.0, 1.0, 0.0) if share == 0.5 else (0.0, 0.0, 0.0, 1.0)
    # Moments of the lag's weight exp(-(d - s)/T)/T ds over s in [0, d]: of 1, s and s², with s in steps.
    z = share * h / lag_s
    moments = [0.0, 0.0, 0.0]
    if z > 0.5:
        moments[0] = 1.0 - exp(-z)
        moments[1] = share * (1.0 - moments[0] / z)
        moments[2] = share * (share - 2.0 * moments[1] / z)
    else:
        # The same as power series, where the differences above would leave few digits.
        for power in range(3):
            total, factor = 0.0, 1.0
            for n in range(20):
                # exp(-z) e^{z q} = sum over n of z^n (q - 1)^n / n!; the integral of q^m (1 - q)^n is a beta function.
                beta = 1.0
                for j in range(1, power + 1):
                    beta *= j / (n + j)
                total += factor * beta / (n + power + 1)
                factor *= -z / (n + 1)
            moments[power] = z * share**power * total
    m0, m1, m2 = moments
    return exp(-z), m0 - 3.0 * m1 + 2.0 * m2, 4.0 * (m1 - m2), 2.0 * m2 - m1
