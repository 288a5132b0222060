"""Benchmarks against the best rivals at hand; `python -m tests.bench` writes reports/benchmarks.md."""
