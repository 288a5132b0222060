"""Lines of keys: against a text whose lines were counted by hand, and against texts written with their lines known."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ferryid.vessel.toml_lines import key_lines, line_of

TEXT = '''# a comment
name = "x"   # with [brackets
[hull.D]
"X_|u|u" = -1.0
'Y_v' = 2

[[actuator]]
name = "a = [b"
thrust = { kind = "table", speed = [
    1, 2,
    3] }
[actuator.rudder]
area_m2 = 1.0
[[actuator]]
note = """
name = "not a key"
[not.a.table]
"""
name = "second"
dotted.key = 1
[signals."t1.speed"]
escaped = "a \\" [ b"
last = 1
'''


def test_lines_counted_by_hand() -> None:
    tomllib.loads(TEXT)
    lines = key_lines(TEXT)
    expected = {
        ("name",): 2,
        ("hull",): 3,
        ("hull", "D"): 3,
        ("hull", "D", "X_|u|u"): 4,
        ("hull", "D", "Y_v"): 5,
        ("actuator", 0): 7,
        ("actuator", 0, "name"): 8,
        ("actuator", 0, "thrust"): 9,
        ("actuator", 0, "rudder"): 12,
        ("actuator", 0, "rudder", "area_m2"): 13,
        ("actuator", 1): 14,
        ("actuator", 1, "note"): 15,
        ("actuator", 1, "name"): 19,
        ("actuator", 1, "dotted", "key"): 20,
        ("signals", "t1.speed"): 21,
        ("signals", "t1.speed", "last"): 23,
    }
    assert {path: lines.get(path) for path in expected} == expected
    assert ("not",) not in lines


def test_key_inside_an_inline_table_has_the_line_of_the_key_that_holds_it() -> None:
    assert line_of(key_lines(TEXT), ("actuator", 0, "thrust", "speed")) == 9
    assert line_of(key_lines(TEXT), ("actuator", 1, "missing")) == 14
    assert line_of(key_lines(TEXT), ("nowhere",)) == 1


KEYS = st.text(alphabet="abcxyz_|.=[]# ", min_size=1, max_size=6)
VALUES = st.sampled_from(["1", '"a"', "[1, 2]", "[\n  1,\n  2,\n]", '"""\n[x]\ny = 1\n"""', "'#['", "{ a = 1 }"])


@pytest.mark.slow
@given(st.dictionaries(KEYS, st.dictionaries(KEYS, VALUES, max_size=4), max_size=4))
def test_lines_of_written_tables(tables: dict[str, dict[str, str]]) -> None:
    text, expected = "", {}
    for table, entries in tables.items():
        expected[(table,)] = text.count("\n") + 1
        text += f'["{table}"] # note\n'
        for key, value in entries.items():
            expected[table, key] = text.count("\n") + 1
            text += f'"{key}" = {value}\n'
    tomllib.loads(text)
    lines = key_lines(text)
    assert {path: lines.get(path) for path in expected} == expected
