"""An MCAP file compressed as a whole."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import zstandard


def write(folder: Path, messages: list[Any], ros: Any) -> Path:
    spec = importlib.util.spec_from_file_location("mcap_sample", Path(__file__).with_name("mcap.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    plain = module.write(folder, messages, ros)
    path = plain.with_name(plain.name + ".zst")
    path.write_bytes(zstandard.ZstdCompressor().compress(plain.read_bytes()))
    plain.unlink()
    return path
