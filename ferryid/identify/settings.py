"""The settings of a fit, checked once."""

from __future__ import annotations

from dataclasses import Field, asdict, dataclass, field, fields, replace
from typing import Any

from ferryid.errors import FerryIdError, did_you_mean
from ferryid.identify.thresholds import IDENTIFY
from ferryid.regression.bases import Basis, make_basis, with_hull_length
from ferryid.types import AXES
from ferryid.vessel.profile import Profile

CHOICES = {
    "smoother": ("square", "savgol", "kalman"),
    "residual": ("measured", "commanded", "parallel"),
    "split": ("blocks", "logs", "every-kth"),
    "inertia": ("auto", "fitted"),
    "estimator": ("auto", "derivative", "weak"),
    "accept": ("full", "thesis"),
}


FOLDS = 5
"""Usual number of folds of a cross-validation."""
WITHOUT_SWAY = ("surge", "yaw")
"""Axes of a model that is reduced to them, as sway is not measured."""
TEST_WINDOW_S = 1.0
"""Smoothing window of test rows [s], whatever window is tried."""
WINDOWS_S = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Smoothing windows that are usually tried [s]."""


@dataclass(frozen=True)
class FitSettings:
    """How to fit; the defaults suit a first look at any trial.

    Attributes
    ----------
    basis, structure
        See `make_basis`; wind and current join the basis when all logs have them, and the hull's length
        where the name lacks it.
    smoother, residual, split, inertia, estimator
        One of `CHOICES`; inertia ``"auto"`` holds it at the base model's on axes where the fitted one cannot be right.
    accept
        ``"full"``: besides the held-out error, inertia, damping, free runs and the amount of held-out data have to be right;
        ``"thesis"``: the held-out error alone.
    components
        Number of SIMPLS components, or ``"auto"`` for cross-validation within the training rows.
    window_s
        Length of the smoothing window [s].
    windows_s
        Windows [s] of which cross-validation within the training rows chooses `window_s`; none: it is as given.
    rate_hz
        Rate of the uniform grid [Hz]; None takes the navigation's, at most 20 Hz.
    delta, sigma, zeta
        Factors on the base model's M and C, D, and force, thesis (4.2)-(4.5).
    draws
        Block-bootstrap draws for the coefficient intervals.
    seed
        Seed of the bootstrap.
    estimator
        ``"derivative"``: smoothed velocities are differentiated and forces regressed on accelerations, as in the thesis;
        ``"weak"``: the equations of motion are averaged over windows and nothing is differentiated, see
        `ferryid.identify.weak_rows`; ``"auto"``: the one of less error on folds of the training rows.
    weak_window_s
        Length of the windows of the weak form [s]; None: 8 s for a vessel of 5 m, by Froude's law for others, and training
        windows up to three times as long where these tell more.
    axes
        Axes that are fitted and judged. `on` leaves out sway for a vessel of which it is not measured; the base model's sway
        is then kept.

    Raises
    ------
    FerryIdError
        For a value that is not possible, with the nearest that is.
    """

    basis: str = "modulus"
    structure: str = "decoupled"
    components: str | int = "auto"
    window_s: float = 1.0
    windows_s: tuple[float, ...] = ()
    smoother: str = "square"
    residual: str = "measured"
    split: str = "blocks"
    inertia: str = "auto"
    accept: str = "full"
    rate_hz: float | None = None
    delta: float = 1.0
    sigma: float = 1.0
    zeta: float = 1.0
    draws: int = 500
    seed: int = 0
    estimator: str = "auto"
    weak_window_s: float | None = None
    axes: tuple[str, ...] = field(default=AXES, metadata={"follows": "the vessel"})

    @classmethod
    def options(cls) -> tuple[Field[Any], ...]:
        """Return the settings that are to be chosen; the others follow from the vessel."""
        return tuple(one for one in fields(cls) if "follows" not in one.metadata)

    def __post_init__(self) -> None:
        # Says what is wrong with either before any log is read; the hull's length comes with the profile.
        make_basis(with_hull_length(self.basis, 1.0, "settings"), structure=self.structure)
        for key, options in CHOICES.items():
            value = getattr(self, key)
            if value not in options:
                raise FerryIdError(
                    f"--{key}: there is no {key} called {value!r}.{did_you_mean(str(value), options)} "
                    f"Fix: choose one of {', '.join(options)}"
                )
        text = str(self.components)
        if text != "auto":
            if not (text.isascii() and text.isdigit()) or int(text[:6]) < 1:
                raise FerryIdError(
                    f"--components: {text!r} is not a number of components. Fix: give 1 or more, or auto"
                )
            object.__setattr__(self, "components", int(text))
        check_window(self.window_s)
        for window_s in self.windows_s:
            check_window(window_s, "--windows")
        if self.windows_s and self.smoother == "kalman":
            raise FerryIdError(
                "--window auto: the Kalman smoother finds its window by likelihood. Fix: give one window, which it keeps to at "
                "least, or another --smoother"
            )
        if self.rate_hz is not None and not 0.1 <= self.rate_hz <= 1000.0:
            raise FerryIdError(f"--rate: {self.rate_hz} Hz is no usable rate. Fix: give 0.1 to 1000 Hz, 20 is usual")
        if self.weak_window_s is not None and not 0.5 <= self.weak_window_s <= 300.0:
            raise FerryIdError(
                f"--weak-window: {self.weak_window_s} s is no window of the weak form. Fix: give 0.5 to 300 s, or none"
            )
        if not 1 <= self.draws <= 100_000:
            raise FerryIdError(f"draws: {self.draws} is no number of draws. Fix: give 1 to 100000, 500 is usual")
        if not 0 <= self.seed < 2**63:
            raise FerryIdError(f"--seed: {self.seed} is no seed. Fix: give a whole number from 0 to {2**63 - 1}")
        for key in ("delta", "sigma", "zeta"):
            value = getattr(self, key)
            if not IDENTIFY.least_factor <= value <= 100.0 and not (key == "sigma" and value == 0.0):
                least = f"{'0, or ' if key == 'sigma' else ''}{IDENTIFY.least_factor:g} to 100"
                raise FerryIdError(f"--{key}: {value} is no usable factor. Fix: give {least}, near 1 as a rule")

    @property
    def scale(self) -> dict[str, float]:
        """Factors on the base model."""
        return {"delta": self.delta, "sigma": self.sigma, "zeta": self.zeta}

    def on(self, profile: Profile) -> FitSettings:
        """Return the settings on one vessel: the basis with the length of its hull, where it needs one, and its axes.

        Raises
        ------
        FerryIdError
            Where the basis needs a length that the profile does not have.
        """
        basis = with_hull_length(self.basis, profile.hull.length_m, profile.path or profile.name)
        return replace(self, basis=basis, axes=AXES if profile.measures_sway else WITHOUT_SWAY)

    @property
    def reduced(self) -> bool:
        """Whether sway is not measured, so that surge and yaw alone are fitted and judged."""
        return self.axes == WITHOUT_SWAY

    @property
    def by_thesis(self) -> bool:
        """Whether the thesis's estimator is judged by its own criterion: force errors, row by row."""
        return self.estimator == "derivative" and self.accept == "thesis"

    def plain(self) -> dict[str, Any]:
        """Return the settings as plain values for a model file."""
        plain = {key: value for key, value in asdict(self).items() if key not in self.scale}
        windows_s, axes = list(plain.pop("windows_s")), list(plain.pop("axes"))
        if self.reduced:
            plain["axes"] = axes
        return {**plain, "windows_s": windows_s} if windows_s else plain


def check_components(components: str | int, functions: Basis) -> None:
    """Refuse more components than a basis has functions; ``"auto"`` is never too many.

    Raises
    ------
    FerryIdError
        With the largest number that is possible.
    """
    most = len(functions.terms)
    if components != "auto" and int(components) > most:
        raise FerryIdError(
            f"--components: {components} are more than the {most} functions of the basis {functions.name}. "
            f"Fix: give 1 to {most}, or auto"
        )


def check_window(window_s: float | None, option: str = "--window") -> None:
    """Refuse what is no smoothing window; None stands for a default."""
    if window_s is not None and window_s != 0.0 and not IDENTIFY.shortest_window_s <= window_s <= 60.0:
        raise FerryIdError(
            f"{option}: {window_s} s is no smoothing window. "
            f"Fix: give {IDENTIFY.shortest_window_s:g} to 60 s, 1.0 is usual, or 0 for none"
        )


def parse_windows(text: str) -> tuple[float, ...]:
    """Return the smoothing windows [s] of a list such as ``"0.5,1,2"``; none of an empty one."""
    windows = []
    for part in filter(None, (part.strip() for part in text.split(","))):
        try:
            windows.append(float(part))
        except ValueError as error:
            raise FerryIdError(
                f"--windows: {part!r} is no number of seconds. Fix: give a list such as 0.5,1,2"
            ) from error
    return tuple(windows)


def parse_window(text: str) -> dict[str, Any]:
    """Return `window_s` of a number, `windows_s` of ``"auto"``, as settings take them."""
    if text == "auto":
        return {"windows_s": WINDOWS_S}
    try:
        return {"window_s": float(text)}
    except ValueError as error:
        raise FerryIdError(
            f"--window: {text!r} is no smoothing window. Fix: give seconds, 1.0 is usual, or auto"
        ) from error
