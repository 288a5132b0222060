"""``python -m tests.wavy`` writes reports/waves.md."""

from __future__ import annotations

import tempfile
from pathlib import Path

from tests.evidence import stamp
from tests.wavy.wavy import ROOT, lines, wavy

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as scratch:
        told = wavy(Path(scratch))
    (ROOT / "reports" / "waves.md").write_text("\n".join(lines(told)), encoding="utf-8")
    stamp("reports/waves.md")
