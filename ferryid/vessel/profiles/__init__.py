"""vessel/profiles."""
