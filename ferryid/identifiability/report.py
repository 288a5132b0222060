"""A study of identifiability as text and as JSON."""

from __future__ import annotations

from typing import Any

from ferryid.counts import counted
from ferryid.diagnose.judging import Key, Likeness, likeness_as_json, separation
from ferryid.effects import effects
from ferryid.effects.wording import listed, titled, uncapitalised
from ferryid.identifiability.sensors import SENSORS
from ferryid.identifiability.study import Assessment, Study


def as_json(study: Study) -> dict[str, Any]:
    """Return a study as it stands under ``identifiability`` in ``ferryid.vessel-check/1``."""
    return {
        "trial": study.trial.says,
        **_assessment_as_json(study.own),
        "likeness": None if study.own.likeness is None else likeness_as_json(study.own.likeness),
        "further": [
            {"sensor": name, "gained": _gained(study, one), **_assessment_as_json(one)}
            for name, one in study.with_further
        ],
        "best": study.best,
    }


def as_text(study: Study) -> str:
    """Return a study as text for a terminal."""
    own = study.own
    lines = [
        study.trial.says,
        f"Sensors: {listed([SENSORS[name] for name in SENSORS if name in own.sensors]) or 'none'}.",
    ]
    if own.likeness is None:
        lines.append(f"Nothing can be distinguished: {own.reason}")
    else:
        apart = sorted(own.apart - {(one, None) for one in own.measured}, key=str)
        lines += [
            "",
            "Distinguished from all others at the usual size:",
            *(f"  {_line(own.likeness, key)}" for key in apart),
        ]
        for group in own.groups:
            lines += ["", "These look alike:", *(f"  {_line(own.likeness, key)}" for key in group)]
            pairs = [pair for pair in own.likeness.alike if pair.first in group]
            best = dict.fromkeys(separation(pair.first, pair.second).manoeuvre for pair in pairs[:2])
            lines.append(f"  to separate them, record {'; '.join(best)}")
        if own.likeness.hidden:
            lines += ["", "Too small at their usual size:"]
            lines += [f"  {_line(own.likeness, one.key)}" for one in own.likeness.hidden]
    if own.measured:
        lines += ["", f"Measured: {listed([_title((one, None)) for one in own.measured])}."]
    if study.with_further:
        lines += ["", "With one further sensor:"]
        lines += [f"  {_further(study, name, one)}" for name, one in study.with_further]
    if study.best is not None:
        lines += ["", f"{SENSORS[study.best][:1].upper()}{SENSORS[study.best][1:]} would separate most."]
    elif study.with_further:
        lines += ["", "No further sensor would separate more on this trial; a manoeuvre has to."]
    else:
        told = "the profile maps every kind that bears on this vessel; a manoeuvre has to."
        lines += ["", f"No further sensor would separate more: {told}"]
    return "\n".join(lines)


def _assessment_as_json(one: Assessment) -> dict[str, Any]:
    return {
        "sensors": [name for name in SENSORS if name in one.sensors],
        "measured": list(one.measured),
        "distinguished": [_named(key) for key in sorted(one.apart, key=str)],
        "alike": [[_named(key) for key in group] for group in one.groups],
        "hidden": [] if one.likeness is None else [_named(effect.key) for effect in one.likeness.hidden],
        "reason": one.reason or None,
    }


def _gained(study: Study, one: Assessment) -> int:
    return len(one.apart) - len(study.own.apart)


def _further(study: Study, name: str, one: Assessment) -> str:
    gained = sorted(one.apart - study.own.apart, key=str)
    lost = sorted(study.own.apart - one.apart, key=str)
    parts = []
    if gained:
        parts.append(f"distinguishes {counted(len(gained), 'more effect')} ({listed([_title(key) for key in gained])})")
    if lost:
        parts.append(f"no longer {listed([_title(key) for key in lost])}")
    return f"{SENSORS[name]}: {', '.join(parts if gained else ['distinguishes no more', *parts])}"


def _line(likeness: Likeness, key: Key) -> str:
    one = next(effect for effect in likeness.effects if effect.key == key)
    return f"{_title(key):<34} {one.signal_to_noise:8.1f} times the noise"


def _title(key: Key) -> str:
    effect, instance = key
    return uncapitalised(titled(effects()[effect].title, instance))


def _named(key: Key) -> dict[str, str | None]:
    return {"effect": key[0], "instance": key[1]}
