"""The line of the profile that a check gives corrects what the check found."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
import pytest

from ferryid.diagnose.checks import checks
from ferryid.types import Floats
from ferryid.vessel import parse_profile
from ferryid.vessel.frames import wrap
from ferryid.vessel.signal_map import Series, convert
from tests.vessel.test_signal_map import BODY, HEAD

HEADINGS = {
    "deg NED": 'field = "h"\nunit = "deg"\nframe = "NED"\n',
    "rad ENU": 'field = "h"\nunit = "rad"\nframe = "ENU"\nsign = -1\n',
    "deg ENU with an offset": 'field = "h"\nunit = "deg"\nframe = "ENU"\noffset = 30.0\n',
    "quaternion NED": 'quaternion = ["x", "y", "z", "w"]\nframe = "NED"\n',
}
COLUMNS = {"u": 1.0, "v": 0.3, "r": 4.0, "h": 0.4, "x": 0.0, "y": 0.0, "z": np.sin(0.2), "w": np.cos(0.2)}


def converted(text: str) -> dict[str, Floats]:
    given = Series("/nav", np.arange(1), None, {name: np.array([value]) for name, value in COLUMNS.items()})
    return convert(parse_profile(HEAD + text, "boat.toml"), given)


def corrected(text: str, check: str, values: Mapping[str, float]) -> dict[str, Floats]:
    """Put the line that the check gives into the profile, and read the same message again."""
    known = {one.id: one for one in checks()}[check]
    line = known.in_profile(parse_profile(HEAD + text, "boat.toml"), values)
    found = re.fullmatch(r"(\w+) = (.+) in \[signals\.(\w+)\]", line)
    assert found, line
    key, value, signal = found.groups()
    begin = text.index(f"[signals.{signal}]\n") + len(f"[signals.{signal}]\n")
    end = text.find("[signals", begin) if "[signals" in text[begin:] else len(text)
    own = re.sub(rf"(?m)^{key} = .*\n", "", text[begin:end])
    return converted(f"{text[:begin]}{key} = {value}\n{own}{text[end:]}")


@pytest.mark.parametrize(("check", "names"), [("velocity_scale", ("u", "v")), ("yaw_rate_scale", ("r",))])
@pytest.mark.parametrize("before", ["", "scale = 0.5\n"])
def test_a_factor_is_divided_out(check: str, names: tuple[str, ...], before: str) -> None:
    text = BODY.replace("[signals.velocity]\n", f"[signals.velocity]\n{before}")
    text = text.replace("[signals.yaw_rate]\n", f"[signals.yaw_rate]\n{before}")
    plain, found = converted(text), corrected(text, check, {"factor": 1.25})
    for name in ("u", "v", "r"):
        assert found[name] == pytest.approx(plain[name] / (1.25 if name in names else 1.0), rel=1e-3)


def test_a_rate_of_the_wrong_sign_is_turned_round() -> None:
    assert corrected(BODY, "yaw_rate_scale", {"factor": -1.02})["r"] == pytest.approx(-converted(BODY)["r"])


@pytest.mark.parametrize("heading", HEADINGS)
def test_a_bias_is_taken_off_a_heading_however_it_is_mapped(heading: str) -> None:
    text = f'{BODY}[signals.heading]\ntopic = "/nav"\n{HEADINGS[heading]}'
    found = corrected(text, "heading_bias", {"angle": 7.0})
    assert wrap(found["psi"] - converted(text)["psi"] + np.radians(7.0)) == pytest.approx(0.0, abs=1e-3)


def test_an_antenna_is_put_where_it_is() -> None:
    known = {one.id: one for one in checks()}["lever_arm"]
    position = (
        '[signals.position]\ntopic = "/nav"\nfields = ["n", "e"]\nunit = "m"\nframe = "NED"\nmount_m = [1.0, 0.5]\n'
    )
    line = known.in_profile(parse_profile(HEAD + BODY + position, "boat.toml"), {"x": -0.4, "y": 0.25})
    assert line.startswith("mount_m = [0.60, 0.75] in [signals.position]")


def test_what_the_signal_map_does_not_have_it_cannot_correct() -> None:
    bare = parse_profile(HEAD + BODY, "boat.toml")
    assert {one.id: one.in_profile(bare, {"angle": 1.0, "x": 1.0, "y": 1.0, "factor": 1.1}) for one in checks()} == {
        **dict.fromkeys((one.id for one in checks()), ""),
        "velocity_scale": "scale = 0.9091 in [signals.velocity]",
        "yaw_rate_scale": "scale = 0.9091 in [signals.yaw_rate]",
    }
