"""Whether the actuators were engaged in a log: the vessel follows the applied force there as far as an inertia lets it."""

from ferryid.identify.engagement.responses import force_response_of, pooled, unanswered_force, unengaged
from ferryid.identify.force_signs import ForceResponse

__all__ = ["ForceResponse", "force_response_of", "pooled", "unanswered_force", "unengaged"]
