"""A plan as text and as JSON."""

from __future__ import annotations

from math import isfinite
from typing import Any

from ferryid.counts import counted
from ferryid.diagnose.judging import Key
from ferryid.effects import effects
from ferryid.effects.wording import listed, titled, uncapitalised
from ferryid.planning.plan import Expected, Plan, Separated, Track

SCHEMA = "ferryid.plan/1"


def as_json(plan: Plan) -> dict[str, Any]:
    """Return a plan as ``ferryid.plan/1``, without the files that were written."""
    return {
        "schema": SCHEMA,
        "vessel": plan.vessel.name,
        "duration_s": plan.duration_s,
        "path": None if plan.track is None else _track_json(plan.track),
        "drawn": plan.drawn,
        "after": list(plan.after),
        "manoeuvres": [
            {
                "kind": one.kind,
                "says": one.says,
                "begin_s": one.begin_s,
                "end_s": one.end_s,
                "gain": one.gain,
            }
            for one in plan.chosen
        ],
        "generic_hull": plan.generic_hull,
        "usual": plan.usual,
        "usual_area_m": list(plan.usual_area),
        "hardly_better": plan.hardly_better,
        "ratio": plan.ratio if isfinite(plan.ratio) else None,
        "mean_ratio": plan.mean_ratio if isfinite(plan.mean_ratio) else None,
        "expected_ratio": plan.expected_ratio if isfinite(plan.expected_ratio) else None,
        "coefficients": [
            {
                "coefficient": one.name,
                "unit": one.unit,
                "value": one.value,
                "deviation": {"now": one.now, "usual": one.usual, "planned": one.planned},
            }
            for one in plan.hull
        ],
        "pairs": [
            {
                "effects": [{"effect": effect, "instance": instance} for effect, instance in (one.first, one.second)],
                "separated_from": {"now": one.now, "usual": one.usual, "planned": one.planned},
            }
            for one in plan.pairs
        ],
    }


def _track_json(track: Track) -> dict[str, Any]:
    speed, acceleration = track.limits.speed, track.limits.acceleration
    return {
        "area_m": list(track.area),
        "step_s": track.step_s,
        "speed": {"surge_mps": speed[0], "sway_mps": speed[1], "yaw_radps": speed[2]},
        "acceleration": {"surge_mps2": acceleration[0], "sway_mps2": acceleration[1], "yaw_radps2": acceleration[2]},
    }


def as_text(plan: Plan) -> str:
    """Return a plan as a terminal shows it."""
    within = ""
    if plan.track is not None:
        within = f", within {max(plan.track.area):.0f} x {min(plan.track.area):.0f} m"
    count = counted(len(plan.chosen), "manoeuvre")
    lines = [f"{plan.vessel.name}: {count} in {plan.duration_s / 60.0:.1f} min{within}, chosen of {plan.drawn}"]
    if plan.track is not None:
        u, v, r = plan.track.limits.speed
        lines.append(f"speeds up to {u:.2g} m/s ahead, {v:.2g} m/s sideways, {r:.2g} rad/s of turn")
    if doubt := warning(plan):
        lines += ["", doubt]
    lines += [
        "",
        *(f"  {_clock(one.begin_s)}  {one.says}" for one in plan.chosen),
        "",
        summary(plan),
        "",
        f"{'coefficient':<12}{'value':>12}{'now':>10}{'usual':>10}{'planned':>10}  unit (standard deviations expected)",
        *(_line(one) for one in plan.hull),
    ]
    if plan.pairs:
        lines += ["", "Effects that look alike, and from how many times their usual size they separate:"]
        lines += [f"  {_pair(one)}" for one in plan.pairs]
    return "\n".join(lines)


def warning(plan: Plan) -> str:
    """Return that the plan is not worth its trouble, why, and what would help; empty where it is."""
    if not plan.hardly_better:
        return ""
    told = f"This plan is {'no' if plan.expected_ratio >= 1.0 else 'hardly'} better than {plan.usual}"
    takes = f"{plan.usual_area[0]:.0f} x {plan.usual_area[1]:.0f} m"
    if plan.usual_fits:
        return f"{told}, which takes {takes}: record that, or give more --minutes."
    assert plan.area is not None
    return (
        f"{told}, which takes {takes} and does not fit into {plan.area[0]:.0f} x {plan.area[1]:.0f} m: in such an area, runs "
        "are short and slow. Give a larger --area, or more --minutes."
    )


def summary(plan: Plan) -> str:
    """Return what the plan is expected to gain, in a sentence."""
    generic = (
        " The profile has no hull model: a generic one of its dimensions was simulated." if plan.generic_hull else ""
    )
    behind = [one.name for one in plan.hull if one.planned > one.usual]
    less = f" After the usual trial {listed(behind)} would be known better." if behind else ""
    already = f", beside {counted(len(plan.after), 'log')} recorded already" if plan.after else ""
    return (
        f"Expected standard deviations of the hull's coefficients, over those now: in the mean of {len(plan.hull)} "
        f"{plan.expected_ratio:.2f} of that after {plan.usual}; coefficient by coefficient {plan.mean_ratio:.2f} in the "
        f"geometric mean and {plan.ratio:.2f} in the median{already}. They are for the noise of the "
        f"simulator's sensors: they compare trials, and a recording will show larger ones.{less}{generic}"
    )


def _line(one: Expected) -> str:
    return f"{one.name:<12}{one.value:>12.4g}{one.now:>10.3g}{one.usual:>10.3g}{one.planned:>10.3g}  {one.unit}"


def _pair(one: Separated) -> str:
    sizes = [
        f"{name} {_size(size)}" for name, size in (("now", one.now), ("usual", one.usual), ("planned", one.planned))
    ]
    return f"{_title(one.first)} and {_title(one.second)}: {', '.join(sizes)}"


def _size(size: float | None) -> str:
    return "not" if size is None else f"{size:.2g}"


def _title(key: Key) -> str:
    return uncapitalised(titled(effects()[key[0]].title, key[1]))


def _clock(seconds: float) -> str:
    return f"{int(seconds // 60):2d}:{int(seconds % 60):02d}"
