"""Prints the size of a checkout: lines and files of the program, and the modules that one diagnosis loads.

``make size`` counts this checkout, ``make size CHECKOUT=PATH`` another version, run with the libraries of this one.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_LOG = "four.mcap"
_DIAGNOSE = f"""
import atexit, importlib, json, sys
sys.path.insert(0, sys.argv.pop(1))
import cli
sys.modules["ferryid.cli"] = cli
atexit.register(lambda: print(json.dumps(sorted(sys.modules))))
sys.argv = ["ferryid", "diagnose", "{_LOG}", "--vessel", "milliampere", "--out", "out"]
importlib.import_module("cli.main").main()
"""


def loaded(checkout: Path) -> list[str]:
    """Return the names of the modules in a process that has diagnosed a simulated log."""
    with tempfile.TemporaryDirectory() as folder:
        simulate = [sys.executable, "-m", "ferryid.cli.main", "simulate", "four-corner", "--log", _LOG]
        subprocess.run(simulate, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        diagnose = [sys.executable, "-c", _DIAGNOSE, str(checkout)]
        done = subprocess.run(diagnose, cwd=folder, capture_output=True, text=True, encoding="utf-8", check=False)
    names = done.stdout.rstrip().rpartition("\n")[2]
    if not names.startswith("["):
        raise SystemExit(f"{checkout}: the diagnosis of a simulated log did not end. Fix: see above\n{done.stderr}")
    return json.loads(names)


def main() -> None:
    """Print one line a figure."""
    checkout = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT).resolve()
    files = [path for folder in ("ferryid", "cli") for path in sorted((checkout / folder).rglob("*.py"))]
    if not files:
        raise SystemExit(f"{checkout}: no Python file in ferryid/ or cli/. Fix: give the folder of a checkout")
    names = loaded(checkout)
    own = [name for name in names if name.partition(".")[0] == "ferryid"]
    lines = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files)
    print(f"{lines} lines of Python in {len(files)} files of ferryid/ and cli/")
    print(f"{len(own)} modules of ferryid loaded by one diagnosis, {len(names)} modules in all")


if __name__ == "__main__":
    main()
