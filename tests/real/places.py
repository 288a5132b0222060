"""Where the recordings lie, and where the reports go."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"
REPORTS = ROOT / "reports"
FOLDER = REPORTS / "real"
