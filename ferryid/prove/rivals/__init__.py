"""What others would do with the same logs: the thesis's pipeline, sparse regression and stepwise least squares."""

from __future__ import annotations

from collections.abc import Mapping

from ferryid.prove.rivals import sindy, stepwise, thesis
from ferryid.prove.rivals.learnt import Learner, Learnt, Named

__all__ = ["RIVALS", "Learner", "Learnt", "Named"]

RIVALS: Mapping[str, Learner] = {"thesis": thesis.learn, "sindy": sindy.learn, "stepwise": stepwise.learn}
"""Every rival by name."""
