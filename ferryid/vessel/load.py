"""Reading a vessel profile: one TOML file, every fault explained with its line."""

from __future__ import annotations

import hashlib
import os
import re
import sys
import tomllib
from functools import lru_cache
from importlib import resources
from pathlib import Path
from shlex import quote

from ferryid.counts import counted
from ferryid.errors import FerryIdError, did_you_mean
from ferryid.ingest.log import TableLayout
from ferryid.vessel.dimensions import LONGEST_WINDOW_S, SHORTEST_WINDOW_S
from ferryid.vessel.faults import Fault, TableReader
from ferryid.vessel.parse_actuators import parse_actuators, with_curve
from ferryid.vessel.parse_hull import parse_hull, parse_wind
from ferryid.vessel.parse_signals import parse_signals
from ferryid.vessel.profile import SETTINGS, Profile
from ferryid.vessel.toml_lines import key_lines, too_deep

SCHEMA = "ferryid.vessel/1"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,79}")
"""The name of a vessel: models are stored under it, so that it is no longer than theirs."""
NAME_RULE = 'use up to 80 letters, digits, ".", "-" and "_" only'


def bundled() -> tuple[str, ...]:
    """Return the names of the profiles that come with ferryid."""
    folder = resources.files("ferryid.vessel.profiles")
    return tuple(sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml")))


def user_folder() -> Path:
    """Return the folder of the user's own profiles: ``ferryid/vessels`` in that of the system for configuration."""
    base = os.environ.get("APPDATA" if sys.platform == "win32" else "XDG_CONFIG_HOME", "")
    return (Path(base) if base else Path("~/.config").expanduser()) / "ferryid" / "vessels"


def user_profiles() -> dict[str, Path]:
    """Return the user's own profiles: the name of each file without its suffix, and its path."""
    try:
        return {path.stem: path for path in sorted(user_folder().glob("*.toml")) if path.is_file()}
    except OSError:
        return {}


def known() -> tuple[str, ...]:
    """Return the names of all profiles that have one: the user's own and the bundled ones."""
    return tuple(sorted({*bundled(), *user_profiles()}))


def load_profile(name_or_path: str | Path) -> Profile:
    """Load a profile by its name, the user's own before a bundled one, or from a TOML file.

    Raises
    ------
    FerryIdError
        For a name that is not known, a file that cannot be read, and for the first fault in a profile, with its line
        and the number of other faults.
    """
    text, where = _source(name_or_path)
    return parse_profile(text, where)


def given_as(profile: Profile) -> str:
    """Return what commands take for a profile: the path of its file, or its name; empty where neither leads to its text.

    That of a model may be known by the file alone that the model was fitted with.
    """
    for name in (profile.path, profile.name):
        try:
            if _source(name)[0] == profile.text:
                return name
        except FerryIdError:
            continue
    return ""


@lru_cache(maxsize=16)
def parse_profile(text: str, where: str) -> Profile:
    """Parse the text of a profile; `where` names it in messages and becomes `Profile.path`.

    Those parsed last are kept: a stored model has its profile as text, and is asked for what it expects of log after log.

    Raises
    ------
    FerryIdError
        For the first fault, with its line and the number of other faults.
    """
    profile, faults = _parse(text, where)
    errors = [fault for fault in faults if not fault.warning]
    if profile is None or errors:
        first = errors[0]
        more = len(errors) - 1
        others = f" ({counted(more, 'more fault')}: see ferryid vessel check {quote(where)})" if more else ""
        raise FerryIdError(f"{where}:{first.line}: {first.message}{others}")
    return profile


def check_profile(path: str | Path) -> list[Fault]:
    """Return every fault and warning of a profile, in the order of their lines.

    Raises
    ------
    FerryIdError
        When there is no such file or bundled profile, or it cannot be read as text.
    """
    text, where = _source(path)
    return _parse(text, where)[1]


def _source(name_or_path: str | Path) -> tuple[str, str]:
    """Return a profile's text and the name under which messages show it."""
    name = str(name_or_path)
    own = user_profiles().get(name)
    if own is not None:
        return _source(own)
    if name in bundled():
        resource = resources.files("ferryid.vessel.profiles").joinpath(f"{name}.toml")
        return resource.read_text(encoding="utf-8"), f"{name}.toml"
    path = Path(name)
    if not path.is_file():
        if path.suffix == ".toml" or len(path.parts) > 1:
            raise FerryIdError(
                f"{name}: the vessel profile cannot be read, found "
                f"{'a folder' if path.is_dir() else 'no such file'}. Fix: give the path of a TOML file, or one of "
                f"{', '.join(known())}"
            )
        raise FerryIdError(
            f"{name}: no vessel profile of this name is bundled or in {user_folder()}, and no such file exists."
            f"{did_you_mean(name, known())} Fix: give the path of a TOML file, or one of {', '.join(known())}"
        )
    try:
        return path.read_text(encoding="utf-8-sig"), name
    except UnicodeDecodeError as error:
        raise FerryIdError(
            f"{name}: the vessel profile must be UTF-8 text, found byte {error.object[error.start]:#04x} at offset "
            f"{error.start}. Fix: save it as UTF-8"
        ) from error
    except OSError as error:
        raise FerryIdError(
            f"{name}: the vessel profile cannot be read, found {error.strerror}. Fix: check its permissions"
        ) from error


def _parse(text: str, where: str) -> tuple[Profile | None, list[Fault]]:
    try:
        data = tomllib.loads(text)
        deep = too_deep(data)
    # A number of thousands of digits, or thousands of brackets, ends in errors of Python rather than of TOML.
    except (ValueError, RecursionError) as error:
        return None, [_syntax_fault(text, str(error))]
    if deep:
        return None, [Fault(1, deep)]
    if not data:
        what = f'the file holds no key. Fix: begin with schema = "{SCHEMA}", or with a copy of a bundled profile'
        return None, [Fault(1, f"{what} (ferryid vessel show milliampere --toml)")]
    faults: list[Fault] = []
    top = TableReader(data, (), key_lines(text), faults)
    schema = top.text("schema", required=True)
    if schema and schema != SCHEMA:
        top.fault(
            f'schema "{schema}" is not known here. Fix: write schema = "{SCHEMA}"'
            + (", or install a newer ferryid" if schema.startswith("ferryid.vessel/") else ""),
            "schema",
        )
    name = top.text("name", required=True)
    # Of a name that is missing, or no text, that is said already.
    if top.data.get("name") == name and not NAME.fullmatch(name):
        top.fault(f'"name" cannot be "{name[:80]}". Fix: {NAME_RULE}', "name")
    title = top.text("title", default=name)
    source = top.text("source", required=True)
    setting = top.text("setting", options=SETTINGS)
    window_s = top.number("window_s", at_least=SHORTEST_WINDOW_S, at_most=LONGEST_WINDOW_S)
    hull = parse_hull(top.table("hull", required=True, needs="without it there is no base model"))
    wind = parse_wind(top.table("wind"))
    actuators = parse_actuators(top, hull)
    table = _parse_table(top.table("table"))
    signals = parse_signals(
        top.table("signals", required=True, needs="so nothing of a log can be used"), actuators, faults, with_curve(top)
    )
    top.close()
    faults.sort(key=lambda fault: fault.line)
    if hull is None or any(not fault.warning for fault in faults):
        return None, faults
    profile = Profile(
        name=name,
        title=title,
        source=source,
        hull=hull,
        actuators=actuators,
        wind=wind,
        signals=signals,
        table=table,
        path=where,
        text=text,
        sha256=hashlib.sha256(text.encode()).hexdigest(),
        setting=setting,
        window_s=window_s,
    )
    return profile, faults


def _syntax_fault(text: str, message: str) -> Fault:
    """Turn a `tomllib` message, which names its line in words, into a fault."""
    match = re.search(r"line (\d+)", message)
    line = int(match.group(1)) if match else max(1, len(text.splitlines()))
    plain = re.sub(r"\s*\(at .*\)$", "", message)
    return Fault(line, f"not valid TOML: {plain[:1].lower()}{plain[1:]}. Fix: correct this line or the one above")


def _parse_table(reader: TableReader | None) -> TableLayout | None:
    if reader is None:
        return None
    time = reader.text("time")
    time_unit = reader.text("time_unit", "s", options=("s", "ms", "us", "ns", "datetime"))
    stamp = reader.texts("stamp")
    columns = reader.texts("columns")
    skip_rows = reader.whole("skip_rows", 0, at_most=10**9)
    separator = reader.text("separator", ",")
    if separator not in (",", ";", "\t", "|", "whitespace"):
        reader.fault(f'"separator" cannot be {separator!r}. Fix: use ",", ";", "\\t", "|" or "whitespace"', "separator")
    encoding = reader.text("encoding", "utf-8")
    try:
        known = "0,a\n".encode(encoding).decode(encoding, "replace") == "0,a\n"
    except (LookupError, ValueError):
        known = False
    if not known:
        reader.fault(f'unknown text encoding "{encoding}". Fix: use utf-8, cp1252 or latin-1', "encoding")
    if columns and len(set(columns)) < len(columns):
        twice = next(column for column in columns if columns.count(column) > 1)
        reader.fault(f'"columns" names "{twice}" twice', "columns")
    if columns and time and time not in columns:
        hint = did_you_mean(time, columns)
        reader.fault(f'the time column "{time}" is not among "columns".{hint}', "time")
    if len(stamp) > 2:
        reader.fault(f'"stamp" takes one column, or two (seconds, nanoseconds), found {len(stamp)}', "stamp")
    reader.close()
    return TableLayout(time, time_unit, stamp, columns, skip_rows, separator, encoding)
