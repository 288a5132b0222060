"""Definitions of ROS message types as logs hold them: parsed and checked before any code is generated from them.

rosbags turns a definition into Python code and runs it. Every name that reaches that code is checked here against the
rules of ROS, and every count against a bound, so that a small definition cannot take the time and memory of a large one.
"""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, TypesysError, get_types_from_msg, get_typestore
from rosbags.typesys.base import make_typesdict
from rosbags.typesys.idl import IDLParser
from rosbags.typesys.peg import Success

from ferryid.counts import counted
from ferryid.ingest.layout import EMPTY_MEMBER, MAX_DEPTH, SIZES

Types = dict[str, tuple[list[Any], list[Any]]]
"""Message type to (constants, fields), as rosbags parses a definition."""

MAX_DEFINITION_BYTES = 256 << 10
"""Text of one message type with all that it is made of; the largest in common use has a tenth of this."""
MAX_TYPES = 2000
"""Message types, and constants, that one definition may hold."""
MAX_FIELDS = 50_000
"""Leaf fields of one message type, counted through everything that it is made of."""
MAX_FIELD_TEXT = 16 << 20
"""Characters of the paths of all leaf fields together."""
MAX_ARRAY = 1 << 24
"""Elements of a fixed array of numbers."""
MAX_UNROLLED = 1024
"""Elements of all fixed arrays of strings or messages: rosbags generates code for each, in two to three milliseconds."""
MAX_INSTANCES = 20_000
"""Messages nested in one message through fixed arrays."""
MAX_INTEGER = 1 << 64

_TYPE_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*(/[A-Za-z][A-Za-z0-9_]*)*")
_FIELD_NAME = re.compile(r"_?[A-Za-z][A-Za-z0-9_]*")
_IDL_FILE = re.compile(r"^=+\r?\nIDL: [^\n]*\n", re.MULTILINE)
# Lines that define nothing, on which rosbags' parser spends far more time than on those that do.
_BLANK = re.compile(r"^[ \t]*(#[^\n]*)?\n", re.MULTILINE)
# Strings, characters and comments, which may hold anything and may lack their end, brackets, and names of annotations.
_IDL_TOKEN = re.compile(
    r'"(?:[^"\\]|\\.?)*+(?:"|\Z)|\'(?:[^\'\\]|\\.?)*+(?:\'|\Z)|//[^\n]*|/\*.*?(?:\*/|\Z)|[()]'
    r"|@[ \t]*(?:::)?\w++(?:::\w++)*+",
    re.DOTALL,
)
# What rosbags' generated module uses itself: a type of this name, outside any package, would stand in for it.
_RESERVED = frozenset({"dataclass", "annotations", "T", "TYPE_CHECKING", "ClassVar", "Typesdict", "FIELDDEFS", "np"})
# rosbags raises these for texts that it cannot parse or turn into code.
PARSER_ERRORS: tuple[type[Exception], ...] = (
    TypesysError,
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    MemoryError,
    NameError,
    RecursionError,
    SyntaxError,
    TypeError,
    ValueError,
)


class DefinitionError(ValueError):
    """A message definition that cannot be used; the text completes "the definition of <type> ..."."""


def parse_definition(text: str, msgtype: str, encoding: str) -> Types:
    """Parse the definition of one message type, without running code.

    Parameters
    ----------
    text
        The definition as the log holds it, with the types that it is made of.
    msgtype
        Normalised name, ``"nav_msgs/msg/Odometry"``.
    encoding
        ``"ros1msg"``, ``"ros2msg"``, ``"ros2idl"`` or ``"omgidl"``.

    Returns
    -------
    dict
        Types that rosbags may register: their names are plain and their sizes bounded.

    Raises
    ------
    DefinitionError
        For a text that is no definition, names that are not allowed, and anything over the bounds of this module.
    """
    if not _TYPE_NAME.fullmatch(msgtype):
        raise DefinitionError("cannot be used: the type's name is not one of ROS")
    try:
        if len(text) > MAX_DEFINITION_BYTES:
            raise DefinitionError(f"is larger than {MAX_DEFINITION_BYTES >> 10} KiB")
        if encoding in ("ros2idl", "omgidl"):
            types: Types = {}
            for part in _IDL_FILE.split(text):
                if part.strip():
                    types.update(_IdlParser(_without_annotations(part)).types())
        else:
            types = dict(get_types_from_msg(_BLANK.sub("", text), msgtype))
    except DefinitionError:
        raise
    except PARSER_ERRORS as error:
        raise DefinitionError("cannot be parsed") from error
    return checked(types, empty_bytes=0 if encoding == "ros1msg" else 1)


def register(store: Any, types: Types) -> None:
    """Let rosbags generate the classes of parsed and checked types.

    Raises
    ------
    DefinitionError
        Where rosbags cannot, and where the store holds another definition of one of the types.
    """
    try:
        store.register(types)
    except PARSER_ERRORS as error:
        raise DefinitionError("cannot be used") from error


def typestore_of(types: Types) -> Any:
    """Return a rosbags Typestore that holds these types alone, so that equal names in other logs cannot clash.

    Raises
    ------
    DefinitionError
        Where rosbags cannot generate their classes.
    """
    store = get_typestore(Stores.EMPTY)
    register(store, types)
    return store


def md5sum(store: Any, msgtype: str) -> str:
    """Return the checksum that ROS1 gives a registered type, or an empty string where its definition is incomplete."""
    try:
        return str(store.generate_msgdef(msgtype)[1])
    except PARSER_ERRORS:
        return ""


def checked(types: Types, *, empty_bytes: int) -> Types:
    """Return the types as they may be registered: checked, and without constants that Python cannot write down.

    Parameters
    ----------
    types
        What rosbags parsed.
    empty_bytes
        What an empty message is serialised as [bytes].

    Raises
    ------
    DefinitionError
        For names that are not allowed, and anything over the bounds of this module.
    """
    if len(types) > MAX_TYPES:
        raise DefinitionError(f"holds more than {MAX_TYPES} types")
    classes: set[str] = set()
    kept: Types = {}
    for name, (constants, fields) in types.items():
        _check_names(name, [entry[0] for entry in (*constants, *fields)])
        if len(constants) + len(fields) > MAX_FIELDS:
            raise DefinitionError(f"has more than {MAX_FIELDS} fields")
        # rosbags calls the class of a/b a__b.
        classes.add(name.replace("/", "__"))
        kept[name] = ([entry for entry in constants if _writable(entry[2])], fields)
    if len(classes) < len(types):
        raise DefinitionError("holds two types whose names rosbags cannot distinguish")
    _Extents(kept, empty_bytes).check()
    return kept


def _check_names(name: str, members: list[str]) -> None:
    if not _TYPE_NAME.fullmatch(name) or name in _RESERVED or keyword.iskeyword(name):
        raise DefinitionError("cannot be used: it holds a type whose name is not one of ROS")
    if not all(_FIELD_NAME.fullmatch(member) for member in members):
        raise DefinitionError("cannot be used: it holds a field whose name is not one of ROS")


def _writable(value: Any) -> bool:
    """Tell whether a constant survives being written into Python code."""
    if isinstance(value, float):
        return math.isfinite(value)
    return isinstance(value, str) or (isinstance(value, int) and abs(value) <= MAX_INTEGER)


@dataclass(frozen=True)
class _Extent:
    """Size of one message type, counted through everything that it is made of."""

    depth: int = 0
    leaves: int = 0
    text: int = 0
    instances: int = 1
    least_bytes: int = 0


class _Extents:
    """Counts every type once, however often others contain it."""

    def __init__(self, types: Types, empty_bytes: int) -> None:
        self._types: Mapping[str, Any] = {**get_typestore(Stores.EMPTY).fielddefs, **types}
        self._empty_bytes = empty_bytes
        self._known: dict[str, _Extent] = {}
        self._open: set[str] = set()
        self._unrolled = 0

    def check(self) -> None:
        for name in self._types:
            self._of(name)

    def _of(self, name: str) -> _Extent:
        found = self._known.get(name)
        if found is not None:
            return found
        if name not in self._types:
            # An incomplete definition: whoever lists the fields finds that out.
            return _Extent()
        if name in self._open:
            raise DefinitionError(f"cannot be used: {name} contains itself")
        if len(self._open) > MAX_DEPTH:
            raise DefinitionError(f"is nested more than {MAX_DEPTH} deep")
        self._open.add(name)
        parts = [self._member(field, desc) for field, desc in self._types[name][1]]
        self._open.remove(name)
        whole = _Extent(
            1 + max((part.depth for part in parts), default=0),
            sum(part.leaves for part in parts),
            sum(part.text for part in parts),
            1 + sum(part.instances for part in parts),
            sum(part.least_bytes for part in parts) if parts else self._empty_bytes,
        )
        if whole.depth > MAX_DEPTH:
            raise DefinitionError(f"is nested more than {MAX_DEPTH} deep")
        if whole.leaves > MAX_FIELDS or whole.text > MAX_FIELD_TEXT:
            raise DefinitionError(
                f"has {counted(whole.leaves, 'field')} with {counted(whole.text, 'character')}, at most "
                f"{MAX_FIELDS} with {MAX_FIELD_TEXT} "
                "can be listed"
            )
        if whole.instances > MAX_INSTANCES:
            raise DefinitionError(f"holds more than {MAX_INSTANCES} messages in one")
        self._known[name] = whole
        return whole

    def _member(self, field: str, desc: Any) -> _Extent:
        kind, inner = desc
        fixed = kind == Nodetype.ARRAY
        listed = fixed or kind == Nodetype.SEQUENCE
        count = 1
        if listed:
            (kind, inner), count = inner
            if not isinstance(count, int) or not 0 <= count < MAX_INTEGER:
                raise DefinitionError(f"cannot be used: {field} has an impossible length")
        if kind == Nodetype.NAME:
            if not _TYPE_NAME.fullmatch(inner):
                raise DefinitionError("cannot be used: it holds a type whose name is not one of ROS")
            element = self._of(inner)
        else:
            element = _Extent(0, 1, 0, 0, self._primitive_bytes(field, inner[0]))
        if fixed:
            self._check_array(field, count, plain=kind != Nodetype.NAME and inner[0] != "string")
        elif listed and element.least_bytes == 0 and not (kind == Nodetype.NAME and inner not in self._types):
            raise DefinitionError(f"cannot be used: {field} is a sequence of elements without content")
        path = 1 + len(field) + (2 + len(str(count)) if listed else 0)
        return _Extent(
            element.depth,
            element.leaves,
            element.text + path * max(element.leaves, 1),
            element.instances * (count if fixed else 1),
            4 if listed and not fixed else element.least_bytes * count,
        )

    def _primitive_bytes(self, field: str, primitive: str) -> int:
        if primitive == "string":
            return 4
        if primitive not in SIZES:
            raise DefinitionError(f"cannot be used: {field} is of type {primitive}, which cannot be decoded")
        return 0 if field == EMPTY_MEMBER and not self._empty_bytes else SIZES[primitive]

    def _check_array(self, field: str, count: int, *, plain: bool) -> None:
        if plain:
            if count > MAX_ARRAY:
                raise DefinitionError(f"cannot be used: {field} is an array of {count} elements, at most {MAX_ARRAY}")
            return
        self._unrolled += count
        if self._unrolled > MAX_UNROLLED:
            raise DefinitionError(f"cannot be used: it has arrays of more than {MAX_UNROLLED} strings or messages")


def _without_annotations(text: str) -> str:
    """Return IDL without annotations, which change nothing of what is decoded and cost rosbags' parser most of its time."""
    kept: list[str] = []
    start = depth = 0
    # Where the last annotation begins and its name ends, as long as what it is given may follow.
    begin = named = -1
    for token in _IDL_TOKEN.finditer(text):
        first = token[0][0]
        if begin >= 0 and depth == 0 and (first != "(" or text[named : token.start()].strip()):
            kept += (text[start:begin], " ")
            start, begin = named, -1
        if begin < 0:
            if first == "@":
                begin, named = token.span()
        elif first in "()":
            depth += 1 if first == "(" else -1
            if depth == 0:
                kept += (text[start:begin], " ")
                start, begin = token.end(), -1
    if begin >= 0 and depth == 0:
        kept += (text[start:begin], " ")
        start = named
    return "".join([*kept, text[start:]])


class _Integer(int):
    """Integer of an IDL expression, which is refused before it needs more than 64 bits."""

    def __new__(cls, value: int) -> _Integer:
        if abs(value) > MAX_INTEGER:
            raise DefinitionError("cannot be used: it holds a constant of more than 64 bits")
        return super().__new__(cls, value)

    def __lshift__(self, other: int) -> _Integer:
        if other > MAX_INTEGER.bit_length():
            raise DefinitionError("cannot be used: it holds a constant of more than 64 bits")
        return _Integer(int(self) << int(other))


def _bounded(name: str) -> Callable[..., _Integer]:
    operation = getattr(int, name)
    return lambda *operands: _Integer(operation(*operands))


for _name in ("neg", "invert", "add", "sub", "mul", "floordiv", "mod", "rshift", "and", "or", "xor"):
    setattr(_Integer, f"__{_name}__", _bounded(f"__{_name}__"))


class _IdlParser(IDLParser):
    """rosbags' IDL parser with results remembered by place, so that nested brackets cost no more than flat text.

    Truth values count as integers 0 and 1, for nothing else bounds what a shift makes of them.
    """

    REMEMBERED = (
        *(f"{level}_expr" for level in ("or", "xor", "and", "shift", "add", "mult", "unary", "primary")),
        *("scoped_name", "type_spec", "sequence_type", "annotation_appl"),
    )

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._remembered: dict[tuple[str, int], Any] = {}
        if len(re.findall(r"\b(?:const|struct|enum|typedef)\b", text)) > MAX_TYPES:
            raise DefinitionError(f"holds more than {MAX_TYPES} types and constants")

    def types(self) -> Types:
        """Return what the text defines."""
        return dict(make_typesdict(self.specification()))

    def integer_literal(self, pos: int) -> Any:
        """Parse an integer."""
        return _as_integer(super().integer_literal(pos))

    def boolean_literal(self, pos: int) -> Any:
        """Parse a truth value."""
        return _as_integer(super().boolean_literal(pos))


def _as_integer(result: Any) -> Any:
    return Success(result.pos, _Integer(result.value)) if isinstance(result, Success) else result


def _once(name: str) -> Callable[[Any, int], Any]:
    rule = getattr(IDLParser, name)

    def parse(self: Any, pos: int) -> Any:
        key = name, pos
        if key not in self._remembered:
            self._remembered[key] = rule(self, pos)
        return self._remembered[key]

    return parse


for _name in _IdlParser.REMEMBERED:
    setattr(_IdlParser, _name, _once(_name))


class FieldList:
    """Leaf fields of one message, collected by a walk over its definition that ends at the bounds of this module."""

    def __init__(self) -> None:
        self.fields: dict[str, str] = {}
        self._visits = 0
        self._text = 0

    def visit(self) -> None:
        """Count one field or message that the walk comes to.

        Raises
        ------
        DefinitionError
            Where a definition leads to too many of them.
        """
        self._visits += 1
        if self._visits > 2 * MAX_FIELDS:
            raise DefinitionError(f"has more than {MAX_FIELDS} fields")

    def add(self, path: str, primitive: str) -> None:
        """List one leaf.

        Raises
        ------
        DefinitionError
            For more leaves, or longer paths, than can be listed.
        """
        self._text += len(path)
        if len(self.fields) >= MAX_FIELDS or self._text > MAX_FIELD_TEXT:
            raise DefinitionError(f"has more than {MAX_FIELDS} fields or {MAX_FIELD_TEXT} characters in their names")
        self.fields[path] = primitive

    def collect(self, leaves: Iterator[tuple[str, str]]) -> dict[str, str]:
        """List everything that a walk gives."""
        for path, primitive in leaves:
            self.add(path, primitive)
        return self.fields
