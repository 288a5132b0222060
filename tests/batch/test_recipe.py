"""Recipes: checked before any log is read, each fault with its line."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ferryid.batch.recipe import Recipe, load_recipe
from ferryid.errors import FerryIdError
from ferryid.identify.settings import FitSettings

GUIDE = Path(__file__).resolve().parents[2] / "docs" / "guide.md"


def loaded(folder: Path, text: str) -> Recipe:
    path = folder / "recipe.toml"
    path.write_text(text, encoding="utf-8")
    return load_recipe(path)


def test_an_empty_one_is_the_default(tmp_path: Path) -> None:
    assert loaded(tmp_path, "") == Recipe()
    assert Recipe().steps == ("fit", "evaluate", "diagnose")


def test_the_default_in_the_documentation_is_the_default(tmp_path: Path) -> None:
    (text,) = (
        block for block in re.findall(r"```toml\n(.*?)```", GUIDE.read_text("utf-8"), re.DOTALL) if "steps" in block
    )
    assert loaded(tmp_path, text) == Recipe()
    assert {one.name for one in FitSettings.options() if one.name in text} == {
        one.name for one in FitSettings.options()
    }


def test_every_setting_of_a_fit_can_stand_in_it(tmp_path: Path) -> None:
    values = {one.name: one.default for one in FitSettings.options()} | {"rate_hz": 10, "components": 5, "window_s": 2}
    values |= {"windows_s": [0.5, 1], "weak_window_s": 6.0}
    text = "\n".join(f"{name} = {value!r}" for name, value in values.items())
    recipe = loaded(tmp_path, f'steps = ["diagnose", "fit"]\n[diagnose]\nwithhold = ["wind"]\n[fit]\n{text}\n')
    assert recipe.steps == ("fit", "diagnose")
    assert recipe.withhold == ("wind",)
    assert recipe.fit == FitSettings(rate_hz=10, components=5, window_s=2, windows_s=(0.5, 1), weak_window_s=6.0)


def test_results_depend_on_the_settings_of_the_steps_alone(tmp_path: Path) -> None:
    one = loaded(tmp_path, 'steps = ["evaluate"]\n[fit]\nwindow_s = 2.0\n')
    other = loaded(tmp_path, 'steps = ["evaluate"]\n')
    assert one.plain() == other.plain()
    assert loaded(tmp_path, "[fit]\nwindow_s = 2.0\n").plain() != Recipe().plain()
    assert loaded(tmp_path, "[fit]\nreport = false\n").plain() != Recipe().plain()
    assert "report" not in Recipe().plain()["fit"], "what was done before the key was there stands"
    assert loaded(tmp_path, '[diagnose]\nwithhold = ["wind"]\n').plain() != Recipe().plain()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('\nsteps = ["fit", "diagnos"]', r'2: there is no step "diagnos"\. Did you mean "diagnose"\?'),
        ('[fit]\nwindows_s = [1, "2"]', r'2: "windows_s" is a list of numbers, found'),
        ("steps = []", r"1: names no step\."),
        ('steps = "fit"', r'1: "steps" is a list of names, found \'fit\'\.'),
        ("stpes = []", r'1: a recipe has no "stpes"\. Did you mean "steps"\?'),
        ("[fit]\n\nwindow = 2", r'3: a recipe has no "window" in \[fit\]\. Did you mean "window_s"\?'),
        ('[fit]\nwindow_s = "2"', r'2: "window_s" is a number, found \'2\'\.'),
        ("[fit]\nseed = 1.5", r'2: "seed" is a whole number, found 1\.5\.'),
        ("[fit]\ncomponents = true", r'2: "components" is text or a whole number, found True\.'),
        ("[fit]\nwindow_s = 99", r"1: in \[fit\], --window: 99 s is no smoothing window\."),
        ("[fit]\ndraws = 0", r"1: in \[fit\], draws: 0 is no number of draws\."),
        ('[fit]\nbasis = "modulos"', r'1: in \[fit\], .*Did you mean "modulus"'),
        ("[fit]\nreport = 1", r'2: "report" is true or false, found 1\.'),
        ("fit = 3", r'1: "fit" is a section, found 3\.'),
        ("model = 2", r'1: "model" is text, found 2\.'),
        ('[diagnose]\nwithhold = ["wend"]', r'2: --withhold: "wend" is not .* Did you mean "wind"\?'),
        ("steps = ", r" cannot be read as a recipe, "),
        ("a = " + "[" * 60 + "]" * 60, r" tables or arrays hold each other"),
    ],
)
def test_faults(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(FerryIdError, match=rf"recipe\.toml:{says}.*Fix: "):
        loaded(tmp_path, text)


def test_what_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(FerryIdError, match=r"none\.toml: cannot be read as a recipe, No such file"):
        load_recipe(tmp_path / "none.toml")
