"""The command line: one module per command, found by name and imported when it is called."""

from __future__ import annotations

from ferryid.cli.main import main

__all__ = ["main"]
