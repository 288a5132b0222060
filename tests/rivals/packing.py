"""Findings and scores as plain values, as they are kept of a run that may be ended."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tests.rivals.scores import Score
from tests.rivals.simulated import Findings, Found


def packed(findings: Findings) -> dict[str, Any]:
    """Return findings as plain values."""
    return {name: one if isinstance(one, str) else _plain(one) for name, one in findings.items()}


def unpacked(plain: dict[str, Any]) -> Findings:
    """Return the findings of `packed`."""
    return {name: one if isinstance(one, str) else _made(Found, one) for name, one in plain.items()}


def packed_scores(scores: dict[str, Score]) -> dict[str, Any]:
    """Return scores as plain values."""
    return {name: _plain(one) for name, one in scores.items()}


def unpacked_scores(plain: dict[str, Any]) -> dict[str, Score]:
    """Return the scores of `packed_scores`."""
    return {name: _made(Score, {**one, "failed": tuple(one["failed"])}) for name, one in plain.items()}


def _plain(one: Found | Score) -> dict[str, Any]:
    values = {name: getattr(one, name) for name in one.__dataclass_fields__}
    return {
        name: {"shape": value.shape, "values": value.ravel().tolist()} if isinstance(value, np.ndarray) else value
        for name, value in values.items()
    }


def _made(kind: Callable[..., Any], values: dict[str, Any]) -> Any:
    return kind(
        **{
            name: np.array(value["values"], dtype=np.float64).reshape(value["shape"])
            if isinstance(value, dict)
            else value
            for name, value in values.items()
        }
    )
