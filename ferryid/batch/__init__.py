"""Fit, evaluate and diagnose every log of an archive."""
