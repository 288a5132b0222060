"""DataFlash logs of ArduPilot: heads of messages and definitions."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path
from random import Random

from pymavlink import DFReader

from tests.attack.case import Base, Mutated, Mutation, Rows, odd_number, replaced
from tests.attack.logs import messages, rows
from tests.ingest.autopilot_logs import DataFlash

NAME = "log.bin"
WANTED = {"/POS": ("x", "y", "z"), "/SPD": ("data",)}


def bases() -> list[Base]:
    """Without instances, and with them."""
    return [_base("plain", instances=False), _base("instances", instances=True)]


def _base(name: str, *, instances: bool) -> Base:
    log = DataFlash()
    log.define("POS", "Qddd", "TimeUS,x,y,z")
    log.define("SPD", "QBd" if instances else "Qd", "TimeUS,I,data" if instances else "TimeUS,data")
    if instances:
        log.units("SPD", "s#n")
    for topic, time, value in messages():
        if topic == "/position":
            log.add("POS", time // 1000, value, -1.0, 0.0)
        else:
            log.add("SPD", time // 1000, *((0,) if instances else ()), value)
    content = bytes(log.content)
    return Base("dataflash", name, {NAME: content}, NAME, _truth(content), WANTED)


def _truth(content: bytes) -> dict[str, Rows]:
    found = []
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        (Path(folder) / NAME).write_bytes(content)
        log = DFReader.DFReader_binary(str(Path(folder) / NAME))
        while (message := log.recv_msg()) is not None:
            name = f"/{message.get_type()}"
            if name in WANTED:
                found.append((name, int(message.TimeUS) * 1000, float(getattr(message, WANTED[name][0]))))
        log.close()
    return rows(iter(found))


def _heads(content: bytes) -> list[int]:
    places, at = [], content.find(b"\xa3\x95")
    while at >= 0:
        places.append(at)
        at = content.find(b"\xa3\x95", at + 2)
    return places


def head(random: Random, base: Base) -> Mutated | None:
    """Set the type of a message, or what it is recognised by."""
    content = bytearray(base.files[NAME])
    at = random.choice(_heads(bytes(content))) + random.randrange(3)
    old = content[at]
    content[at] = odd_number(random, 1, old)
    if content[at] == old:
        return None
    what = f"byte {at} of a head set from {old} to {content[at]}"
    return Mutated(what, replaced(base, NAME, bytes(content)), counted=False, content=True)


def definition(random: Random, base: Base) -> Mutated | None:
    """Set a byte of a definition."""
    content = bytearray(base.files[NAME])
    starts = [at for at in _heads(bytes(content)) if content[at + 2] == 0x80]
    at = random.choice(starts) + 3 + random.randrange(86)
    old = content[at]
    content[at] = random.choice((0, 0xFF, ord("Z"), ord(","), ord("a"), 0x1B, odd_number(random, 1, old)))
    if content[at] == old:
        return None
    what = f"byte {at} of a definition set from {old} to {content[at]}"
    return Mutated(what, replaced(base, NAME, bytes(content)), counted=False, content=True)


def again(random: Random, base: Base) -> Mutated | None:
    """Define a message again in the midst of the log, with another layout or another name."""
    log = DataFlash()
    for name in random.sample(("POS", "SPD", "GPS", "FMT", "FMTU", "UNIT"), 3):
        log.define(name, *random.choice((("Qd", "TimeUS,data"), ("Qh", "TimeMS,TimeUS"), ("Z", "TimeUS"), ("d", "x"))))
    content = base.files[NAME]
    at = random.choice(_heads(content))
    made = content[:at] + log.content + content[at:]
    return Mutated(f"other definitions at {at}", replaced(base, NAME, made), counted=False, content=True)


MUTATIONS: dict[str, Mutation] = {"head of a message": head, "definition": definition, "defined again": again}
