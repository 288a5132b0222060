"""Which heavy packages each command loads: those that it needs, and no others."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from ferryid.side_by_side import usable_cores

HEAVY = (
    "aiohttp", "apsw", "distributed", "google.protobuf", "jinja2", "llvmlite", "matplotlib", "mcap", "numba", "pandas",
    "pyarrow", "pyarrow.dataset", "pydantic", "rich", "rosbags", "rosbags.highlevel", "rosbags.rosbag2", "ruamel",
    "scipy", "scipy.cluster", "scipy.linalg", "scipy.optimize", "scipy.signal", "scipy.spatial", "scipy.special", "scipy.stats",
    "sqlite3",
)  # fmt: skip
"""What takes more than some hundredths of a second to load."""
READS = {"mcap", "rosbags"}
KEEPS = {"pyarrow"}
LOOPS = {"llvmlite", "numba", "scipy"}
"""numba looks for scipy, and needs its linear algebra only where a loop does."""
ESTIMATES = {"scipy", "scipy.linalg", "scipy.special", "scipy.optimize", "scipy.spatial"}
PAGES = {"matplotlib", "jinja2"}
DRAWN_BESIDE = PAGES - {"matplotlib"} if usable_cores() > 1 else PAGES
"""What makes a page whose figures a second process draws meanwhile."""
LOG = "fixtures/short.mcap"
VESSEL = ("--vessel", "milliampere")
COMMANDS: dict[str, tuple[tuple[str, ...], set[str]]] = {
    "inspect": (("inspect", LOG), READS | {"scipy", "scipy.linalg", "scipy.special"}),
    "ingest": (("ingest", LOG, *VESSEL), READS | KEEPS),
    "ingest again": (("ingest", LOG, *VESSEL), KEEPS),
    "fit": (("fit", LOG, *VESSEL, "--accept", "thesis", "--no-report"), ESTIMATES | KEEPS),
    "fit with its page": (
        ("fit", LOG, *VESSEL, "--accept", "thesis", "--components", "3"),
        ESTIMATES | KEEPS | PAGES,
    ),
    "evaluate": (("evaluate", "milliampere@1", LOG), ESTIMATES | KEEPS),
    "diagnose": (
        ("diagnose", LOG, *VESSEL),
        ESTIMATES | KEEPS | LOOPS | READS | DRAWN_BESIDE | {"scipy.cluster"},
    ),
    "compare": (("compare", "milliampere@1", "milliampere@2", "--on", LOG), ESTIMATES | KEEPS | PAGES),
    "sweep": (("sweep", "components", LOG, *VESSEL), ESTIMATES | KEEPS | PAGES),
    "models": (("models",), set()),
    "export": (("export", "milliampere@1", "--to", "python"), {"scipy.special"}),
    "simulate": (("simulate", "four-corner"), LOOPS | READS),
    "vessel list": (("vessel", "list"), set()),
    "vessel check": (("vessel", "check", "milliampere"), set()),
}
PROGRAM = """
import json, sys
from ferryid.cli.main import main
sys.argv = ["ferryid", *sys.argv[1:]]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
print(json.dumps(sorted(sys.modules)), file=sys.stderr)
"""


@pytest.mark.slow
def test_a_command_loads_what_it_needs(tmp_path: Path) -> None:
    # In one test, as commands use what those before them leave.
    too_much = {}
    for name, (words, needed) in COMMANDS.items():
        out = () if words[0] == "vessel" or words[0] == "inspect" else ("--out", str(tmp_path))
        run = subprocess.run([sys.executable, "-c", PROGRAM, *words, *out], capture_output=True, text=True, check=False)
        assert run.returncode == 0, (name, run.stdout, run.stderr)
        loaded = set(json.loads(run.stderr.splitlines()[-1]))
        if more := loaded & set(HEAVY) - needed:
            too_much[name] = sorted(more)
    assert not too_much
