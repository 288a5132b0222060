"""Validation of `ferryid diagnose`: effects injected into an independent plant, diagnosed blind, scored against an oracle."""
