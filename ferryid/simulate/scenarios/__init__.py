"""simulate/scenarios."""
