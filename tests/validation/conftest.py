"""Processes that find these tests, and a Dask cluster."""

from __future__ import annotations

from tests.batch.conftest import cluster, importable

__all__ = ["cluster", "importable"]
