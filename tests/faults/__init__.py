"""Faults of the system at every operation of the commands that write."""
