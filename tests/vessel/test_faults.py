"""Every fault of a table says what to do about it, in one line."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from ferryid.vessel.faults import Fault, TableReader


@pytest.mark.parametrize(
    ("value", "take", "told"),
    [
        ("x", lambda t: t.number("key"), "must be a number, found a string"),
        (-1.0, lambda t: t.number("key", above=0.0, at_most=9.0), "must be above 0 and at most 9, found -1"),
        (10.0, lambda t: t.number("key", at_least=2.0, at_most=9.0), "at least 2 and at most 9, found 10"),
        (10.0, lambda t: t.number("key", at_most=9.0), "must be at most 9, found 10"),
        (float("nan"), lambda t: t.number("key"), "must be finite, found nan"),
        (1e308, lambda t: t.number("key"), "is not plausible for any vessel, it must be at most 1e+15 in size"),
        ([1.0, -1e308], lambda t: t.numbers("key", 2), '"key" = -1e+308 is not plausible for any vessel'),
        (10**6, lambda t: t.whole("key", 0, at_most=1000), "at least 0 and at most 1000, found 1000000"),
        ([1.0, "x"], lambda t: t.numbers("key"), "must be an array of finite numbers"),
        ([1.0], lambda t: t.numbers("key", 2), "must hold 2 numbers, found 1"),
        (["a", 1], lambda t: t.texts("key"), "must be an array of strings"),
        (["a"], lambda t: t.texts("key", 2), "must name 2 fields, found 1"),
        (1.5, lambda t: t.whole("key", 0), "must be a whole number of at least 0, found 1.5"),
        ("y" * 1000, lambda t: t.whole("key", 0), "found 'yyy"),
        (1, lambda t: t.flag("key", True), "must be true or false, found a number"),
        (1, lambda t: t.text("key"), "must be a string, found a number"),
        ("a\nb\x1b", lambda t: t.text("key", options=("c",)), r'cannot be "a\nb\x1b"'),
    ],
)
def test_a_fault_names_its_remedy(value: object, take: Callable[[TableReader], object], told: str) -> None:
    faults: list[Fault] = []
    take(TableReader({"key": value}, (), {(): 1}, faults))
    (fault,) = faults
    assert told in fault.message
    assert "Fix: " in fault.message
    assert fault.message.isprintable()
    assert len(fault.message) < 200
