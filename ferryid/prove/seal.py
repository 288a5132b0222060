"""Sealing the answers: a published hash binds whoever drew them, and encryption keeps them from whoever is tested.

Before anything is diagnosed, the hash of all answers and a random salt is published (`commitment`); the answers themselves
lie on disk encrypted (`sealed`). Afterwards both are laid open, and anybody can hash them again (`verified`).

The encryption is a keystream of SHAKE-256 under a key stretched from the seed, with an HMAC over the whole. It is there to
keep answers from the process that diagnoses, and from a reader who comes upon the file. It is not meant to withstand a
cryptanalyst: a seed has few bits, and somebody who guesses it can draw the answers again without any file.
"""

from __future__ import annotations

import hmac
import json
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import pbkdf2_hmac, sha256, shake_256
from pathlib import Path
from typing import Any

from ferryid import __version__
from ferryid.errors import FerryIdError
from ferryid.files import dump_json, finite, replacing, write_text

SEAL, ANSWERS = "ferryid.seal/1", "ferryid.answers/1"
SALT_BYTES = NONCE_BYTES = 16
TAG_BYTES = 32
STRETCH = 200_000
"""Rounds of hashing that a guess at the seed costs."""


@dataclass(frozen=True, repr=False)
class Key:
    """What seals and opens: stretched from a seed and a random salt, which may be known."""

    salt: bytes
    secret: bytes

    def mark(self, text: str) -> str:
        """Return a mark that nobody can make, or check, without the key."""
        return hmac.new(self.secret, b"mark" + text.encode(), sha256).hexdigest()


def key_of(seed: int, salt: bytes | None = None) -> Key:
    """Return the key of a seed; with a new salt where none is given."""
    salt = secrets.token_bytes(SALT_BYTES) if salt is None else salt
    return Key(salt, pbkdf2_hmac("sha256", str(seed).encode(), salt, STRETCH))


def canonical(data: Any) -> bytes:
    """Return plain data as JSON in the one form that is hashed: sorted keys, no blanks, UTF-8."""
    text = json.dumps(data, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text.encode()


def commitment(answers: Any, salt: str) -> str:
    """Return what is published of the answers: SHA-256 of the salt [hexadecimal], a line feed and their canonical JSON."""
    return sha256(salt.encode() + b"\n" + canonical(answers)).hexdigest()


def sealed(answers: Any, key: Key) -> bytes:
    """Return plain data encrypted: a random nonce, the text, and a tag over both."""
    nonce = secrets.token_bytes(NONCE_BYTES)
    hidden = nonce + _under(canonical(answers), nonce, key)
    return hidden + hmac.new(key.secret, b"tag" + hidden, sha256).digest()


def opened(data: bytes, key: Key, where: str) -> Any:
    """Return what was sealed.

    Parameters
    ----------
    data, key
        From `sealed`, and the key that it was sealed with.
    where
        Name of the file, for messages.

    Raises
    ------
    FerryIdError
        Where it was sealed with another key, or changed since.
    """
    hidden, tag = data[:-TAG_BYTES], data[-TAG_BYTES:]
    wanted = hmac.new(key.secret, b"tag" + hidden, sha256).digest()
    if len(data) < NONCE_BYTES + TAG_BYTES or not hmac.compare_digest(tag, wanted):
        raise FerryIdError(
            f"{where}: cannot be opened, it was sealed with another seed or changed since. "
            "Fix: give the seed that was printed at the start, or choose a new folder with --out"
        )
    nonce, text = hidden[:NONCE_BYTES], hidden[NONCE_BYTES:]
    return json.loads(_under(text, nonce, key))


def _under(text: bytes, nonce: bytes, key: Key) -> bytes:
    stream = shake_256(b"stream" + key.secret + nonce).digest(len(text))
    return (int.from_bytes(text, "big") ^ int.from_bytes(stream, "big")).to_bytes(len(text), "big")


def seal(folder: Path, answers: Mapping[str, Any], key: Key, sources: str) -> str:
    """Write ``answers.sealed`` and then ``seal.json``; return the commitment.

    Parameters
    ----------
    folder
        Of the proof.
    answers
        Plain data, with a list ``cases``.
    key
        Seals them.
    sources
        Hash of the sources that will diagnose.
    """
    salt, answers = secrets.token_hex(32), finite(answers)
    bound = commitment(answers, salt)
    with replacing(folder / "answers.sealed") as temporary:
        temporary.write_bytes(sealed({"salt": salt, "answers": answers}, key))
    public = {
        "schema": SEAL,
        "commitment": bound,
        "cases": len(answers["cases"]),
        "ferryid_version": __version__,
        "sources": sources,
    }
    write_text(folder / "seal.json", dump_json(public))
    return bound


def open_seal(folder: Path, key: Key) -> tuple[str, Any]:
    """Return commitment and answers of a sealed folder.

    Raises
    ------
    FerryIdError
        Where anything was changed since it was sealed.
    """
    public = _read(folder / "seal.json")
    path = folder / "answers.sealed"
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FerryIdError(
            f"{path}: cannot be read, {error.strerror}, though there is a seal.json beside it. "
            "Fix: put it back, or choose a new folder with --out"
        ) from error
    content = opened(data, key, str(path))
    return _checked(public, content["answers"], content["salt"], path)


def lay_open(folder: Path, key: Key) -> Any:
    """Open a sealed folder, write ``answers.json`` with the salt for anyone to verify, and return the answers.

    Raises
    ------
    FerryIdError
        Where anything was changed since it was sealed.
    """
    _, answers = open_seal(folder, key)
    salt = opened((folder / "answers.sealed").read_bytes(), key, "answers.sealed")["salt"]
    write_text(folder / "answers.json", dump_json({"schema": ANSWERS, "salt": salt, "answers": answers}))
    return answers


def verified(folder: Path) -> Any:
    """Return the answers of a folder laid open, after hashing them against its ``seal.json``.

    Raises
    ------
    FerryIdError
        Where they are not what was sealed.
    """
    path = folder / "answers.json"
    laid = _read(path)
    return _checked(_read(folder / "seal.json"), laid.get("answers"), str(laid.get("salt")), path)[1]


def _checked(public: Mapping[str, Any], answers: Any, salt: str, path: Path) -> tuple[str, Any]:
    bound = commitment(answers, salt)
    if not hmac.compare_digest(bound, str(public.get("commitment"))) or len(answers["cases"]) != public.get("cases"):
        raise FerryIdError(
            f"{path}: is not what was sealed, its hash is {bound[:16]}... and seal.json beside it says "
            f"{str(public.get('commitment'))[:16]}... for {public.get('cases')} cases. Fix: choose a new folder with --out"
        )
    return bound, answers


def _read(path: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text("utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise FerryIdError(
            f"{path}: cannot be read as the JSON object it was written as, {error}. Fix: choose a new folder with --out"
        ) from error
