"""A comparison of models in words and tables, alike on the page and on a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ferryid.compare import BASE, is_of_a_hull
from ferryid.counts import counted
from ferryid.effects import effects
from ferryid.effects.wording import listed, titled
from ferryid.types import AXES

Row = dict[str, Any]

MANY = 4
"""With this many models or more, the base model among them, sentences hold each against the best, not every two."""
ALL = "all logs"
ABOUT_P = (
    "p: how likely a ratio this far from one is if both err alike (bootstrap of blocks of each log, in pairs), corrected for "
    "the number of comparisons on a log (Holm). Intervals are 95 %, of each ratio by itself, so that of many some miss 1 by "
    "chance. They hold the scatter within these logs, not what another day brings. Free: rms error after a "
    "free run of so long."
)


def scopes(result: Row) -> list[tuple[str | None, str, Row]]:
    """Return key, title and part of a result for every log, and for all of them together where there are several."""
    logs = [(entry["name"], entry["name"], entry) for entry in result["logs"]]
    return [*logs, *([(None, ALL, result["pooled"])] if result["pooled"] else [])]


def about(scope: Row) -> str:
    """Return how much there is to judge by."""
    blocks = scope["blocks"]
    length = f" of {scope['block_s']:.3g} s" if "block_s" in scope else ""
    return (
        f"{counted(scope['rows'], 'row')}, {scope['seconds']:.0f} s, {counted(blocks, 'block')}{length}, "
        f"{counted(scope['free_run']['starts'], 'free run')}"
    )


def sentences(result: Row, on: str | None) -> list[str]:
    """Return what is better than what on a log, or on all; differences that were not shown in one sentence for two models."""
    labels = [model["label"] for model in result["models"]]
    rows = [row for row in result["better"] if row["on"] == on]
    if len(labels) >= MANY:
        rows = [row for row in rows if _best(rows, row) in (row["first"], row["second"])]
    # The models that were asked about come before their base model.
    rows.sort(key=lambda row: BASE in (row["first"], row["second"]))
    told = [row["says"] for row in rows if row["better"]] + [row["says"] for row in rows if row["perhaps"]]
    unclear = [row for row in rows if not (row["better"] or row["perhaps"])]
    if len(labels) >= MANY:
        return told + _by_quantity(unclear)
    pairs: dict[frozenset[str], list[Row]] = {}
    for row in unclear:
        pairs.setdefault(frozenset((row["first"], row["second"])), []).append(row)
    return told + [same[0]["says"] if len(same) == 1 else _together(same, labels) for same in pairs.values()]


def _by_quantity(rows: Sequence[Row]) -> list[str]:
    """Return one sentence on all that is not told apart from the best, for each quantity."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        if row["ratio"] is not None:
            groups.setdefault((row["kind"], row["what"]), []).append(row)
    told = []
    for (kind, what), same in groups.items():
        place = f"on {what}" if kind == "force" else f"in {what}, run free for {same[0]['horizon_s']:g} s"
        others = [f"{row['second']} {number(row['ratio'])}{_span(row['low'], row['high'])}" for row in same]
        says = "no difference is shown" if same[0]["low"] is not None else "there is too little data to decide"
        told.append(f"{place}, {same[0]['first']} errs least, but {says}: its error over that of {listed(others)}")
    return told


def _best(rows: Sequence[Row], row: Row) -> str:
    """Return the model with the least error of what a row compares: the one that no other has a ratio below one to."""
    alike = [one for one in rows if (one["kind"], one["what"]) == (row["kind"], row["what"])]
    beaten = {one["second"] for one in alike if one["ratio"] is not None}
    return next((str(one["first"]) for one in alike if one["first"] not in beaten), str(row["first"]))


def _together(rows: Sequence[Row], labels: Sequence[str]) -> str:
    """Return one sentence on all that does not tell two models apart, the ratio of the first over the second with each."""
    first, second = sorted((rows[0]["first"], rows[0]["second"]), key=labels.index)
    if first == BASE:
        first, second = second, first
    parts = []
    for row in rows:
        ratio, low, high = row["ratio"], row["low"], row["high"]
        if row["first"] != first:
            ratio, low, high = (None if one is None or not one > 0.0 else 1.0 / one for one in (ratio, high, low))
        chance = row["p_corrected"]
        p = f", p {chance:.2f}" if chance is not None and np.isfinite(chance) else ""
        parts.append(f"{row['what']} {number(ratio)}{_span(low, high)}{p}")
    if rows[0]["low"] is None:
        return f"too little data to distinguish {first} from {second}, error of the first over the second's: {listed(parts)}"
    return f"no difference shown between {first} and {second}, error of the first over the second's: {listed(parts)}"


def _span(low: float | None, high: float | None) -> str:
    return "" if low is None or high is None else f" [{number(low)}, {number(high)}]"


def number(value: float | None, pattern: str = ".3g") -> str:
    """Return a number, or a dash where there is none."""
    return "–" if value is None or not np.isfinite(value) else format(value, pattern)


def headline(result: Row) -> str:
    """Return which model errs least on each axis, over all logs, and whether that is more than chance."""
    known = scopes(result)
    models = [model["label"] for model in result["models"]]
    if not known:
        return f"{counted(len(models), 'model')} by their coefficients alone: no log was given to judge them on."
    on, title, _ = known[-1]
    groups: dict[tuple[str, str], list[str]] = {}
    for axis in AXES:
        rows = [row for row in result["better"] if (row["on"], row["kind"], row["what"]) == (on, "force", axis)]
        best = _best(rows, rows[0])
        own = [row for row in rows if row["first"] == best]
        if any(row["ratio"] is None for row in rows):
            sure = "as far as the data show"
        elif all(row["better"] for row in own):
            sure = (
                "beyond chance" if all(row["evidence"] for row in own) else "where it was trained, which is no evidence"
            )
        else:
            sure = "which may be chance" if own[0]["p"] is not None else "with too little data to decide"
        groups.setdefault((best, sure), []).append(axis)
    told = [f"{best} on {listed(axes)}, {sure}" for (best, sure), axes in groups.items()]
    return f"Least force error, {title}: {'; '.join(told)}."


def told_horizon(scope: Row) -> int:
    """Return the place of the horizon that free runs are told at: that of the sentences, else the longest with any run."""
    runs = scope["free_run"]
    if runs["told_s"] is not None:
        return int(runs["horizons_s"].index(runs["told_s"]))
    return max((h for h, count in enumerate(runs["counted"]) if count), default=0)


def tracking_line(scope: Row) -> str:
    """Return how closely the vessel kept to the reference in a log; empty where there is none."""
    found = scope.get("tracking")
    if not found:
        return ""
    heading = None if found["heading_rad"] is None else float(np.degrees(found["heading_rad"]))
    within = [
        f"{number(value)} {unit}" for value, unit in ((found["position_m"], "m"), (heading, "deg")) if value is not None
    ]
    return (
        f"the controller that sailed it kept to its reference within {listed(within)} (rms, {found['seconds']:.0f} s): "
        f"ISE {number(found['ISE'])} m²s, IAE {number(found['IAE'])} m s, IAEW {number(found['IAEW'])} m s J, "
        f"EC {number(found['EC'])} J"
    )


def score_columns(scope: Row) -> list[str]:
    """Return the heads of the columns of `score_rows`."""
    horizon = scope["free_run"]["horizons_s"][told_horizon(scope)]
    return [
        *(f"rms {axis} [{unit}]" for axis, unit in zip(AXES, ("N", "N", "N·m"), strict=True)),
        *(f"R² {axis}" for axis in AXES),
        *(f"free {horizon:g} s {what}" for what in ("[m]", "[deg]")),
    ]


def score_rows(result: Row, scope: Row) -> list[tuple[str, list[str]]]:
    """Return for every model: rms error and R² per axis, and how far it strays in position and heading when run free."""
    h = told_horizon(scope)
    rows = []
    for model in result["models"]:
        scores = scope["scores"][model["label"]]
        position, heading = scores["free_run"]["position_m"][h], scores["free_run"]["heading_rad"][h]
        rows.append(
            (
                model["label"],
                [
                    *(number(scores["mse"][axis] ** 0.5) for axis in AXES),
                    *(number(scores["r2"][axis], ".3f") for axis in AXES),
                    number(position),
                    number(None if heading is None else float(np.degrees(heading))),
                ],
            )
        )
    return rows


def model_line(model: Row) -> str:
    """Return what a model is, in half a sentence."""
    if model["base"]:
        return "the hull in the profile alone"
    parts = ["a refitted hull" if model["basis"] == "none" else f"basis {model['basis']}"]
    changed = [f"{name} {value:g}" for name, value in model["scale"].items() if value != 1.0]
    if changed:
        parts.append(f"on a base model with {', '.join(changed)}")
    if model["diagnosed"]:
        parts.append("with what a diagnosis found")
    if model["training"]:
        parts.append(f"trained on {listed(model['training'])}")
    parts.append("accepted" if model["accepted"] else "not accepted")
    return ", ".join(parts)


def coefficient_table(result: Row) -> list[Row]:
    """Return the coefficients of the equations of motion, and below them the terms that are no hull's."""
    rows = [{"name": row["coefficient"], **row} for row in result["coefficients"]["physical"]]
    rows += [
        {"name": f"{_constant(row['term'])} in {row['axis']}", **row}
        for row in result["coefficients"]["terms"]
        if not is_of_a_hull(row["term"], row["axis"])
    ]
    return rows


def cell(value: Row | None) -> tuple[str, str]:
    """Return a coefficient and its interval as text; a dash for one that a model does not have."""
    if value is None or (value["value"] == 0.0 and not value["low"] and not value["high"]):
        return "–", ""
    low, high = value["low"], value["high"]
    known = low is not None and high is not None and low != high
    return number(value["value"], ".4g"), f"{number(low, '.4g')} to {number(high, '.4g')}" if known else ""


def _constant(term: str) -> str:
    return "constant" if term == "1" else term


def render_effects(rows: Sequence[Row]) -> list[str]:
    """Return effects that differ as lines."""
    lines = []
    for row in rows:
        title = titled(effects()[row["effect"]].title, row["instance"])
        lines.append(f"{title}, {'a condition of ' + row['log'] if row['log'] else 'a property of the vessel'}")
        lines += [f"  {label}: {told['says'] if told else 'not in it'}" for label, told in row["values"].items()]
    return lines
