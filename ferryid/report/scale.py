"""How a base model was scaled, in words."""

from __future__ import annotations

from collections.abc import Mapping


def scale_words(scale: Mapping[str, float]) -> str:
    """Return the factors other than one that a base model was fitted with, such as ``"delta 0.4, sigma 0.4"``."""
    return ", ".join(f"{name} {value:g}" for name, value in scale.items() if value != 1.0)
