"""Cross-products and QR factors of plain arrays."""

from __future__ import annotations

from typing import Any

from ferryid.regression import Rows
from ferryid.types import Flags, Floats


def from_rows(
    kind: Any, X: Floats, Y: Floats, mask: Flags | None = None, *, names: tuple[str, ...] = (), where: str = "fit"
) -> Any:
    """Return `kind` of the rows of `X` (n, K) and `Y` (n, m) where `mask` (n,) is true."""
    return kind.of(Rows.of(X, Y, mask, where), names=names, where=where)
