"""Commitment to the answers: their hash is published before any log is diagnosed, they themselves afterwards.

``seal.json`` holds the hash of all answers and a random salt. ``answers.json``, written once every log is diagnosed, holds
both, and anybody can hash them again. In between no answer is on disk: all of them are drawn again from the seed.
"""

from __future__ import annotations

import hmac
import json
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from ferryid import __version__
from ferryid.errors import FerryIdError
from ferryid.files import dump_json, finite, write_text

SEAL, ANSWERS = "ferryid.seal/1", "ferryid.answers/1"
SEAL_FILE, ANSWERS_FILE = "seal.json", "answers.json"


def canonical(data: Any) -> bytes:
    """Return plain data as JSON in the one form that is hashed: sorted keys, no blanks, UTF-8."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.encode()


def commitment(answers: Any, salt: str) -> str:
    """Return the commitment: SHA-256 of the salt [hexadecimal], a line feed and the canonical JSON of the answers."""
    return sha256(salt.encode() + b"\n" + canonical(answers)).hexdigest()


def publish_commitment(folder: Path, answers: Mapping[str, Any], salt: str, source_hash: str) -> str:
    """Write ``seal.json`` and return the commitment.

    Parameters
    ----------
    folder
        Of the run.
    answers
        Plain data, with a list ``cases``.
    salt
        Random, hexadecimal.
    source_hash
        Of the sources that will diagnose.
    """
    answers = finite(answers)
    bound = commitment(answers, salt)
    public = {
        "schema": SEAL,
        "commitment": bound,
        "cases": len(answers["cases"]),
        "ferryid_version": __version__,
        "sources": source_hash,
    }
    write_text(folder / SEAL_FILE, dump_json(public))
    return bound


def publish_answers(folder: Path, answers: Mapping[str, Any], salt: str) -> None:
    """Write ``answers.json``, with the salt for anyone to verify.

    Raises
    ------
    FerryIdError
        For answers that are not those of ``seal.json``.
    """
    answers = finite(answers)
    _check(read_seal(folder), answers, salt, folder / SEAL_FILE)
    write_text(folder / ANSWERS_FILE, dump_json({"schema": ANSWERS, "salt": salt, "answers": answers}))


def read_seal(folder: Path) -> dict[str, Any]:
    """Return what ``seal.json`` of a folder holds.

    Raises
    ------
    FerryIdError
        Where it cannot be read.
    """
    return _read(folder / SEAL_FILE)


def verified_answers(folder: Path) -> Any:
    """Return the published answers of a folder, after hashing them against its ``seal.json``.

    Raises
    ------
    FerryIdError
        Where they are not those of the commitment.
    """
    path = folder / ANSWERS_FILE
    seal, published = read_seal(folder), _read(path)
    answers = published.get("answers")
    if not isinstance(answers, dict) or not isinstance(answers.get("cases"), list):
        raise FerryIdError(f"{path}: holds no answers. Fix: give the folder of a finished run")
    _check(seal, answers, str(published.get("salt")), path)
    return answers


def _check(seal: Mapping[str, Any], answers: Any, salt: str, path: Path) -> None:
    bound, expected = commitment(answers, salt), str(seal.get("commitment"))
    if not hmac.compare_digest(bound.encode(), expected.encode()) or len(answers["cases"]) != seal.get("cases"):
        raise FerryIdError(
            f"{path}: does not match its commitment: the hash is {bound[:16]}..., seal.json has {expected[:16]}... for "
            f"{seal.get('cases')} cases. Fix: restore both files, or choose a new folder with --out"
        )


def _read(path: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text("utf-8")))
    except FileNotFoundError as error:
        raise FerryIdError(
            f"{path}: not found; answers are published once every log is diagnosed. Fix: give the folder of a finished run"
        ) from error
    except (OSError, ValueError, TypeError) as error:
        raise FerryIdError(
            f"{path}: not readable as a JSON object, {error}. Fix: restore the file, or choose a new folder with --out"
        ) from error
