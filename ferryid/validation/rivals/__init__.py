"""Rival methods on the same logs: the thesis's pipeline, sparse regression and stepwise least squares."""

from __future__ import annotations

from collections.abc import Mapping

from ferryid.validation.rivals import sindy, stepwise, thesis
from ferryid.validation.rivals.learner import Learner

__all__ = ["RIVALS", "Learner"]

RIVALS: Mapping[str, Learner] = {"thesis": thesis.learn, "sindy": sindy.learn, "stepwise": stepwise.learn}
"""Every rival by name."""
