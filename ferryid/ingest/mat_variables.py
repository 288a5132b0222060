"""Variables of MAT files as arrays and structures: level 4 and 5 by SciPy, version 7.3 (HDF5) by h5py."""

from __future__ import annotations

import io
import math
import struct
import warnings
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.counts import counted
from ferryid.errors import FerryIdError, one_line
from ferryid.ingest.log import Column, Loss
from ferryid.ingest.mat_tables import MOST_STRUCTS, Leaf, Node

HDF5 = b"\x89HDF\r\n\x1a\n"
_HEADER = 128
_MATRIX, _COMPRESSED = 14, 15
_TYPES = (*range(1, 8), 9, 12, 13, _MATRIX, 16, 17, 18)
"""Types of the parts of a variable: numbers, a matrix of its own, and text."""
_CELL, _STRUCTURE, _OBJECT, _TEXT, _SPARSE, _NUMBERS, _COMPLEX = 1, 2, 3, 4, 5, range(6, 16), 0x800
"""Classes of a variable, and the flag of complex numbers."""
_LARGE_BYTES = 1 << 28
_MOST_TIMES_LARGER = 100
"""A variable of more than `_LARGE_BYTES` that needs this many times the size of its file is not read."""
_MOST_AXES = 64
"""Axes of an array, as many as NumPy has."""
_DEEPEST = 12
"""Structures in structures."""
_FIGURE = ("hgS_", "hgM_", "hgO_")
"""How the variables of a saved figure begin."""


@dataclass
class MatVariables:
    """What a file holds.

    Attributes
    ----------
    found
        Name to array or structure.
    objects
        Name and class of MATLAB objects, of which a file has only what MATLAB itself can read.
    figure
        True where the file is a saved figure.
    losses
        Variables that cannot be read.
    cells
        Cell arrays of something else than texts, and the most numbers in a cell of each: they are not read.
    """

    found: dict[str, Node] = field(default_factory=dict)
    objects: dict[str, str] = field(default_factory=dict)
    figure: bool = False
    losses: list[Loss] = field(default_factory=list)
    cells: dict[str, int] = field(default_factory=dict)


def read_variables(path: Path) -> MatVariables:
    """Read a MAT file of any version.

    Raises
    ------
    FerryIdError
        For a file that is none, is damaged from its beginning, or needs h5py where that is not installed.
    """
    with path.open("rb") as file:
        head = file.read(_HEADER)
        file.seek(512)
        later = file.read(8)
    if head.startswith(HDF5) or later == HDF5:
        return _hdf5(path)
    if head.startswith(b"MATLAB 7.3"):
        raise FerryIdError(f"{path}: the MAT file ends within its head. Fix: copy it again, or save it again in MATLAB")
    if head.startswith((b"# Created by Octave", b"Octave-1-")):
        raise FerryIdError(
            f"{path}: a file in Octave's own format, found no MAT file. Fix: in Octave, save -v7 log.mat"
        )
    content = path.read_bytes()
    return _level_5(path, content) if head.startswith(b"MATLAB") else _level_4(path, content)


def _level_5(path: Path, content: bytes) -> MatVariables:
    """Read variable after variable, so that one that is damaged does not cost the others."""
    if len(content) < _HEADER:
        raise FerryIdError(
            f"{path}: the MAT file ends within its head of {_HEADER} bytes, found {len(content)}. "
            "Fix: copy it again, or save it again in MATLAB"
        )
    order = ">" if content[126:128] == b"MI" else "<"
    result = MatVariables()
    position = _HEADER
    while position < len(content):
        if position + 8 > len(content):
            result.losses.append(_lost(path, "the MAT file ends within a variable"))
            break
        kind, size = struct.unpack_from(f"{order}II", content, position)
        after = position + 8 + size
        if kind not in (_MATRIX, _COMPRESSED) or size == 0:
            result.losses.append(_lost(path, f"what begins at byte {position} of the MAT file is no variable"))
            break
        if after > len(content):
            result.losses.append(_lost(path, "the MAT file ends within a variable"))
            break
        if kind == _MATRIX and (held := _held_bytes(content[position:after], order)) < size:
            # A damaged length would swallow the variables behind it.
            result.losses.append(
                _lost(
                    path,
                    f"the variable at byte {position} of the MAT file holds {counted(held, 'byte')} of the {size} that it "
                    "states",
                )
            )
            after = position + 8 + held
        try:
            _add(result, _loaded(_unpacked(content, position, after, order), order, content[:_HEADER]))
        except Exception as error:  # noqa: BLE001 - SciPy raises whatever a damaged file leads to
            result.losses.append(
                _lost(path, f"the variable at byte {position} of the MAT file cannot be read ({_reason(error)})")
            )
        position = after
    return result


def _level_4(path: Path, content: bytes) -> MatVariables:
    """Read matrices of MATLAB 4, whose file has no head that would name it."""
    import scipy.io

    result = MatVariables()
    file: Any = io.BytesIO(content)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = scipy.io.whosmat(file)
            if any(np.prod(shape, dtype=float) > len(content) for _, shape, _ in found):
                raise ValueError("a variable larger than the file")
            file.seek(0)
            _add(result, scipy.io.loadmat(file))
    except Exception as error:
        raise FerryIdError(
            f"{path}: not a MAT file that can be read ({_reason(error)}). Fix: save it again in MATLAB, or copy it again"
        ) from error
    return result


def _unpacked(content: bytes, position: int, after: int, order: str) -> bytes:
    """Return a variable as it is without compression."""
    (kind,) = struct.unpack_from(f"{order}I", content, position)
    if kind == _MATRIX:
        # With the size that it has, whatever it states.
        return (
            content[position : position + 4]
            + struct.pack(f"{order}I", after - position - 8)
            + content[position + 8 : after]
        )
    most = max(_LARGE_BYTES, _MOST_TIMES_LARGER * len(content))
    stream = zlib.decompressobj()
    plain = stream.decompress(content[position + 8 : after], most)
    if stream.unconsumed_tail:
        raise ValueError(f"it needs more than {most / 1e6:.0f} MB")
    if not stream.eof:
        raise ValueError("its end is missing")
    return plain


def _held_bytes(variable: bytes, order: str) -> int:
    """Return how many bytes the parts of a variable take up, by its class and size; those that it states where that is unknown.

    After flags, dimensions and name come one part for numbers, two for complex ones, one for text, one for each cell, and of
    structures the length and names of fields and one for each of them.
    """
    (stated,) = struct.unpack_from(f"{order}I", variable, 4)
    parts, place = list[bytes](), 8
    wanted = 3
    while len(parts) < wanted:
        if place + 8 > len(variable):
            return int(stated)
        _, start, end, place = _part(variable, place, order)
        parts.append(variable[start:end])
        if len(parts) == 3:
            flags = int.from_bytes(parts[0][:4], "big" if order == ">" else "little")
            count = _count(parts[1], order)
            own = {_CELL: count, _STRUCTURE: 2, _TEXT: 1}.get(flags & 0xFF, 1 + bool(flags & _COMPLEX))
            if flags & 0xFF not in (_CELL, _STRUCTURE, _TEXT, *_NUMBERS) or not 0 <= own <= MOST_STRUCTS:
                return int(stated)
            wanted += own
        elif len(parts) == 5 and flags & 0xFF == _STRUCTURE:
            length = int.from_bytes(parts[3][:4], "big" if order == ">" else "little")
            fields = len(parts[4]) // length if length else 0
            if not 0 <= fields * count <= MOST_STRUCTS:
                return int(stated)
            wanted += fields * count
    return min(place - 8, int(stated))


def _part(variable: bytes, place: int, order: str) -> tuple[int, int, int, int]:
    """Return the type of the part that begins at a place, begin and end of its data, and where the next part begins."""
    kind, size = struct.unpack_from(f"{order}II", variable, place)
    if kind >> 16:
        # Up to four bytes are in the tag itself.
        return kind & 0xFFFF, place + 4, place + 4 + (kind >> 16), place + 8
    return kind, place + 8, place + 8 + size, place + 8 + size + (-size % 8)


def _check_parts(variable: bytes, order: str, begin: int, end: int) -> None:
    """Refuse a variable with a part that is longer than it, or of a type on which SciPy would crash (segmentation fault)."""
    place, number, flags, own_class, stated, inner = begin, 0, 0, 0, 0, 0
    while place + 8 <= end:
        kind, start, stop, following = _part(variable, place, order)
        if stop > end:
            raise ValueError(f"its part at byte {place} is longer than it")
        if kind not in _TYPES or (kind == _MATRIX and own_class in (_TEXT, _SPARSE, *_NUMBERS)):
            raise ValueError(f"its part at byte {place} has type {kind}, not one of its class")
        if kind == _MATRIX:
            _check_parts(variable, order, start, stop)
            inner += 1
        if number == 0:
            flags = int.from_bytes(variable[start : start + 4], "big" if order == ">" else "little")
            own_class = flags & 0xFF
        elif number == 1 and own_class in (_CELL, _STRUCTURE, _OBJECT):
            stated = _count(variable[start:stop], order)
        place, number = following, number + 1
    if number and number < (wanted := _fewest_parts(own_class, bool(flags & _COMPLEX))):
        # What comes after the variable would be read in the place of its numbers.
        raise ValueError(f"it has {counted(number, 'part')}, and its class needs {wanted}")
    if stated > max(inner, 1):
        # Room for all of them is made before the first is read.
        raise ValueError(f"it states {counted(stated, 'element')} and holds {inner}")


def _fewest_parts(own_class: int, is_complex: bool) -> int:
    """Return the parts of a variable: flags, dimensions and name, then its numbers, twice if complex, or its text.

    Sparse ones have rows and columns before them; of other classes the elements are counted.
    """
    numbers = 1 + is_complex
    return 3 + {_TEXT: 1, _SPARSE: 2 + numbers}.get(own_class, numbers if own_class in _NUMBERS else 0)


def _count(dimensions: bytes, order: str) -> int:
    """Return the product of the dimensions of an array."""
    sizes = np.frombuffer(dimensions, f"{order}i4").tolist() if len(dimensions) % 4 == 0 else [0]
    return math.prod(sizes[:_MOST_AXES])


def _loaded(variable: bytes, order: str, header: bytes) -> Mapping[str, Any]:
    import scipy.io

    _check_parts(variable, order, 8, len(variable))
    file: Any = io.BytesIO(header + variable)
    with warnings.catch_warnings():
        # Names that are no names in Python, and functions that are not kept.
        warnings.simplefilter("ignore")
        found: Mapping[str, Any] = scipy.io.loadmat(file, chars_as_strings=True)
    return found


def _add(result: MatVariables, found: Mapping[str, Any]) -> None:
    for name, value in found.items():
        if name.startswith("__"):
            continue
        if name.startswith(_FIGURE):
            result.figure = True
            continue
        node = _node(value, name, result, 0)
        if node is not None:
            result.found[name] = node


def _node(value: Any, path: str, result: MatVariables, depth: int) -> Node | None:
    """Turn what SciPy returned into arrays and structures; None for what holds no numbers."""
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    if isinstance(value, MatlabFunction) or depth > _DEEPEST or not isinstance(value, np.ndarray):
        return None
    if isinstance(value, MatlabOpaque):
        kind, name = _of_object(value, "s2"), _of_object(value, "s0")
        # SciPy returns an object of its own under the name None, and with its name inside.
        result.objects[name if path == "None" and name else path] = kind
        return None
    if value.dtype.names:
        return _structure(value, path, result, depth)
    if value.dtype.kind == "O":
        words = _texts(value)
        if words is None and (most := _most_numbers(value)):
            result.cells[path] = most
        return words
    if value.dtype.kind == "U":
        texts = np.array([str(value.flat[0]) if value.size == 1 else "".join(value.ravel().tolist())], object)
        return Leaf((1,), "O", "string", lambda: texts)
    if value.dtype.kind not in "fiub" or value.size == 0:
        return None
    array = _bare(value)
    return Leaf(array.shape, array.dtype.kind, array.dtype.name, lambda: array)


def _of_object(value: Any, part: str) -> str:
    text = value[part].flat[0] if part in (value.dtype.names or ()) else ""
    return text.decode("ascii", "replace") if isinstance(text, bytes) else str(text)


def _bare(value: np.ndarray[Any, Any]) -> Column:
    """Return an array without axes of length one, in the byte order of the machine."""
    array = value.astype(value.dtype.newbyteorder("="), copy=False).squeeze()
    return array.reshape(1) if array.ndim == 0 else array


def _structure(value: Any, path: str, result: MatVariables, depth: int) -> Node | None:
    names = value.dtype.names
    if value.size == 1:
        inner = {name: _node(value[name].flat[0], f"{path}.{name}", result, depth + 1) for name in names}
        return {name: node for name, node in inner.items() if node is not None} or None
    columns: dict[str, Any] = {}
    series = any(
        isinstance(cell, np.ndarray) and cell.size > 1 and cell.dtype.kind in "fiub"
        for name in names
        for cell in value[name].flat
    )
    for name in () if series else names:
        cells = list(value[name].flat)
        if cells and all(
            isinstance(cell, np.ndarray) and cell.size == 1 and cell.dtype.kind in "fiub" for cell in cells
        ):
            numbers = np.array([cell.flat[0] for cell in cells])
            columns[name] = Leaf(numbers.shape, numbers.dtype.kind, numbers.dtype.name, _constant(numbers))
    if columns:
        return columns
    entries = (_node(one.reshape(1, 1), f"{path}[{k}]", result, depth + 1) for k, one in _few(value))
    return {f"[{k}]": node for k, node in enumerate(entries) if node is not None} or None


def _few(value: Any) -> list[tuple[int, Any]]:
    flat = value.ravel()
    return [(k, flat[k : k + 1]) for k in range(min(len(flat), MOST_STRUCTS))]


def _constant(array: Column) -> Callable[[], Column]:
    return lambda: array


def _most_numbers(value: Any) -> int:
    """Return the size of the largest array in a cell array, one that stands in a structure there among them."""
    sizes = [0]
    for cell in value.flat:
        inner = (
            [one for name in cell.dtype.names for one in cell[name].flat]
            if getattr(cell.dtype, "names", None)
            else [cell]
        )
        sizes += [one.size for one in inner if isinstance(one, np.ndarray) and one.dtype.kind in "fiub"]
    return max(sizes)


def _texts(value: Any) -> Leaf | None:
    """Return a cell array of texts, None for cells of anything else."""
    cells = list(value.flat)
    if not cells or not all(isinstance(cell, np.ndarray) and cell.dtype.kind == "U" for cell in cells):
        return None
    texts = np.empty(len(cells), object)
    texts[:] = [str(cell.flat[0]) if cell.size else "" for cell in cells]
    return Leaf(texts.shape, "O", "string", lambda: texts)


def _hdf5(path: Path) -> MatVariables:
    try:
        import h5py
    except ImportError as error:
        raise FerryIdError(
            f"{path}: a MAT file of version 7.3, which needs h5py. Fix: pip install 'ferryid[matlab]', or in MATLAB "
            "save('log.mat', ..., '-v7')"
        ) from error
    result = MatVariables()
    try:
        with h5py.File(path, "r") as file:
            for key in file:
                name = _hdf5_name(key)
                if name.startswith("#"):
                    continue
                if name.startswith(_FIGURE):
                    result.figure = True
                    continue
                node = _hdf5_node(path, file, file[key], name, result, 0)
                if node is not None:
                    result.found[name] = node
    except Exception as error:
        raise FerryIdError(
            f"{path}: the MAT file cannot be read ({_reason(error)}). Fix: copy it again, or save it again in MATLAB"
        ) from error
    return result


def _hdf5_name(key: str | bytes) -> str:
    """Return a name as text; h5py returns one that is no UTF-8, which MATLAB does not write, as bytes."""
    return key if isinstance(key, str) else key.decode("utf-8", "backslashreplace")


def _hdf5_node(path: Path, file: Any, item: Any, name: str, result: MatVariables, depth: int) -> Node | None:
    import h5py

    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
    if depth > _DEEPEST:
        return None
    if "MATLAB_object_decode" in item.attrs:
        result.objects[name] = kind
        return None
    if isinstance(item, h5py.Group):
        keys = {_hdf5_name(key): key for key in item}
        inner = {
            one: _hdf5_node(path, file, item[key], f"{name}.{one}", result, depth + 1) for one, key in keys.items()
        }
        return _as_columns({one: node for one, node in inner.items() if node is not None})
    if "MATLAB_empty" in item.attrs or not isinstance(item, h5py.Dataset):
        return None
    if item.dtype.kind == "O":
        return _references(path, file, item, name, result, depth)
    if kind == "char":
        text = np.array(["".join(map(chr, np.asarray(item).T.ravel().tolist()))], object)
        return Leaf((1,), "O", "string", lambda: text)
    if item.dtype.kind not in "fiub" or item.size == 0:
        return None
    if item.size * item.dtype.itemsize > max(_LARGE_BYTES, _MOST_TIMES_LARGER * path.stat().st_size):
        raise ValueError(f"{name} is larger than its file can hold")
    # MATLAB counts axes from the other end.
    shape = tuple(size for size in reversed(item.shape) if size != 1) or (1,)
    dtype = np.dtype(bool) if kind == "logical" else item.dtype.newbyteorder("=")
    return Leaf(shape, dtype.kind, dtype.name, _hdf5_loader(path, item.name, dtype))


def _references(path: Path, file: Any, item: Any, name: str, result: MatVariables, depth: int) -> Node | None:
    """Return what references lead to: entries of a structure array, or of a cell array, by number."""
    targets = [file[one] for one in np.asarray(item).T.ravel()[:MOST_STRUCTS]]
    nodes = [_hdf5_node(path, file, one, f"{name}[{k}]", result, depth + 1) for k, one in enumerate(targets)]
    return {f"[{k}]": node for k, node in enumerate(nodes) if node is not None} or None


def _as_columns(fields: dict[str, Any]) -> Node | None:
    """Turn around a structure array, which HDF5 has as a structure of numbered entries."""
    numbered = [key for key, node in fields.items() if isinstance(node, dict) and "[0]" in node]
    if not fields or len(numbered) < len(fields):
        return fields or None
    entries: dict[str, dict[str, Any]] = {}
    for key in numbered:
        for place, node in fields[key].items():
            entries.setdefault(place, {})[key] = node
    return dict(entries)


def _hdf5_loader(path: Path, inside: str, dtype: np.dtype[Any]) -> Callable[[], Column]:
    def load() -> Column:
        import h5py

        try:
            with h5py.File(path, "r") as file:
                return _bare(np.asarray(file[inside]).T).astype(dtype, copy=False)
        except Exception as error:
            raise FerryIdError(
                f"{path}: the variable {inside} of the MAT file cannot be read ({_reason(error)}). "
                "Fix: copy it again, or save it again in MATLAB"
            ) from error

    return load


def _lost(path: Path, what: str) -> Loss:
    return Loss(str(path), what)


def _reason(error: Exception) -> str:
    return one_line(str(error) or type(error).__name__)[:200]
