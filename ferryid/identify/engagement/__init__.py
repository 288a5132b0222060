"""Whether the actuators act in a log as in the others, and at all: the vessel follows the force as its inertia lets it."""

from ferryid.identify.engagement.odd_responses import odd_forces
from ferryid.identify.engagement.responses import force_response_of, pooled, unanswered_force
from ferryid.identify.force_signs import ForceResponse

__all__ = ["ForceResponse", "force_response_of", "odd_forces", "pooled", "unanswered_force"]
