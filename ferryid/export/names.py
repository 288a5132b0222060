"""Names, numbers and sentences in a form that every language takes."""

from __future__ import annotations

import re
import unicodedata

_SIGNS = str.maketrans(
    {"·": "*", "²": "^2", "³": "^3", "⁴": "^4", "°": " deg", "–": "-", "—": "-", "π": "pi", "×": "x"}
)
_LONGEST = 48
"""Most characters of a name; MATLAB takes 63, and a version follows."""


def legal(text: str) -> str:
    """Return a text as a name of letters, digits and underscores: ``X_|u|u`` as ``X_abs_u_u``, ``u^3`` as ``u_3``."""
    spelt = re.sub(r"\|([^|]*)\|", r"_abs_\1_", plain(text))
    name = re.sub(r"_+", "_", re.sub(r"[^A-Za-z0-9]", "_", spelt)).strip("_")
    return name if name[:1].isalpha() else f"n_{name}".rstrip("_")


def identifier(name: str, version: int) -> str:
    """Return a model's name and version as one name: ``milliampere_v2``, never a keyword of a language."""
    return legal(f"{legal(name)[:_LONGEST]}_v{version}")


def number(value: float) -> str:
    """Return a number as every language and YAML read it as a double, and as this very one: ``1.0``, ``1.0e-05``."""
    mantissa, e, exponent = repr(float(value)).partition("e")
    return (mantissa if "." in mantissa else f"{mantissa}.0") + e + exponent


def plain(text: str) -> str:
    """Return a text in ASCII on one line, for a comment that no language ends early or reads as anything else."""
    parted = unicodedata.normalize("NFKD", text.translate(_SIGNS))
    spelt = "".join(c for c in parted if not unicodedata.combining(c)).encode("ascii", "replace").decode("ascii")
    one_line = "".join(c if c.isprintable() else " " for c in spelt)
    # Ends of comments, and what C takes for a continued line or another sign.
    spaced = one_line.replace("\\", "/").replace("*/", "* /").replace("/*", "/ *")
    return re.sub(r"\?(?=\?)", "? ", spaced)
