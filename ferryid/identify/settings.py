"""The settings of a fit, checked once."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identify.basis import basis

CHOICES = {
    "smoother": ("square", "savgol", "kalman"),
    "residual": ("measured", "commanded", "parallel"),
    "split": ("blocks", "logs", "every-kth"),
    "inertia": ("auto", "fitted"),
}


@dataclass(frozen=True)
class FitSettings:
    """How to fit; the defaults suit a first look at any trial.

    Attributes
    ----------
    basis, structure
        See `ferryid.identify.basis.basis`; wind and current join the basis when all logs have them.
    smoother, residual, split, inertia
        One of `CHOICES`; inertia ``"auto"`` holds it at the base model's on axes where the fitted one cannot be right.
    components
        Number of SIMPLS components, or ``"auto"`` for cross-validation within the training rows.
    window_s
        Length of the smoothing window [s].
    rate_hz
        Rate of the uniform grid [Hz]; None takes the navigation's, at most 20 Hz.
    delta, sigma, zeta
        Factors on the base model's M and C, D, and force, thesis (4.2)-(4.5).
    draws
        Block-bootstrap draws for the coefficient intervals.
    seed
        Seed of the bootstrap.

    Raises
    ------
    FerryIdError
        For a value that is not possible, with the nearest that is.
    """

    basis: str = "modulus"
    structure: str = "decoupled"
    components: str | int = "auto"
    window_s: float = 1.0
    smoother: str = "square"
    residual: str = "measured"
    split: str = "blocks"
    inertia: str = "auto"
    rate_hz: float | None = None
    delta: float = 1.0
    sigma: float = 1.0
    zeta: float = 1.0
    draws: int = 500
    seed: int = 0

    def __post_init__(self) -> None:
        basis(self.basis, structure=self.structure)  # says what is wrong with either before any log is read
        for key, options in CHOICES.items():
            value = getattr(self, key)
            if value not in options:
                raise FerryIdError(
                    f"--{key}: there is no {key} called {value!r}.{did_you_mean(str(value), options)} "
                    f"Fix: choose one of {', '.join(options)}"
                )
        text = str(self.components)
        if text != "auto":
            if not (text.isascii() and text.isdigit()) or not 1 <= int(text[:6]) <= 1000:
                raise FerryIdError(
                    f"--components: {text!r} is not a number of components. Fix: give 1 or more, or auto"
                )
            object.__setattr__(self, "components", int(text))
        check_window(self.window_s)
        if self.rate_hz is not None and not 0.1 <= self.rate_hz <= 1000.0:
            raise FerryIdError(f"--rate: {self.rate_hz} Hz is no usable rate. Fix: give 0.1 to 1000 Hz, 20 is usual")
        if not 1 <= self.draws <= 100_000:
            raise FerryIdError(f"draws: {self.draws} is no number of draws. Fix: give 1 to 100000, 500 is usual")
        if not 0 <= self.seed < 2**63:
            raise FerryIdError(f"--seed: {self.seed} is no seed. Fix: give a whole number from 0 on")
        for key in ("delta", "sigma", "zeta"):
            value = getattr(self, key)
            if not 0.0 <= value <= 100.0 or (key != "sigma" and value == 0.0):
                raise FerryIdError(f"--{key}: {value} is no usable factor. Fix: give a number near 1")

    @property
    def scale(self) -> dict[str, float]:
        """Factors on the base model."""
        return {"delta": self.delta, "sigma": self.sigma, "zeta": self.zeta}

    def plain(self) -> dict[str, Any]:
        """Return the settings as plain values for a model file."""
        return {key: value for key, value in asdict(self).items() if key not in self.scale}


def check_window(window_s: float | None) -> None:
    """Refuse what is no smoothing window; None stands for a default."""
    if window_s is not None and not 0.0 <= window_s <= 60.0:
        raise FerryIdError(f"--window: {window_s} s is no smoothing window. Fix: give 0 to 60 s, 1.0 is usual")
