"""Results of commands as pandas tables: what `ferryid.report.outcome.Outcome.tables` gives in a notebook or script."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ferryid.types import AXES

if TYPE_CHECKING:
    import pandas as pd

Row = dict[str, Any]
Result = Mapping[str, Any]
Rows = Callable[[Result], Iterable[Row]]

FREE_RUN = ("position_m", "heading_rad", "speed_mps", "yaw_rate_radps")
"""Errors of free runs, by the horizons."""
LARGE = ("streams", "losses", "found", "missing", "remarks", "left_out", "data_quality")
"""Keys of a log that are no values of a row."""


def tables_of(result: Result) -> dict[str, pd.DataFrame]:
    """Return the tables of a result.

    Parameters
    ----------
    result
        As ``--json`` writes it; its key ``schema`` names its form.

    Returns
    -------
    dict
        Tables by name, those without a row left out; none for a form that has no rows. Units stand in the column ``unit``
        or, as of ``position_m``, at the end of a column's name; ends of intervals are ``low`` and ``high`` (95 %).
    """
    import pandas as pd

    known = TABLES.get(str(result.get("schema", "")).partition("/")[0], {})
    tables = {name: pd.DataFrame(list(rows(result))) for name, rows in known.items()}
    return {name: table for name, table in tables.items() if len(table)}


def _plain(key: str, leave: Sequence[str] = ()) -> Rows:
    """Return the rows of a list of objects, without what is itself a list or an object."""

    def rows(result: Result) -> Iterable[Row]:
        for one in result.get(key) or ():
            yield {
                name: value for name, value in one.items() if name not in leave and not isinstance(value, list | dict)
            }

    return rows


def _estimates(estimates: Mapping[str, Mapping[str, Any]], **of: Any) -> Iterable[Row]:
    """Return a row for every parameter with its interval."""
    for name, one in estimates.items():
        yield {
            **of,
            "parameter": name,
            **{key: value for key, value in one.items() if not isinstance(value, list | dict)},
        }


def _logs(result: Result) -> Sequence[Result]:
    """Return the diagnoses of a campaign, or the one of a single log."""
    return result.get("logs") or [result]


def _findings(result: Result) -> Iterable[Row]:
    for log in _logs(result):
        for one in log["findings"]:
            of = {"log": log["log"], "effect": one["effect"], "instance": one["instance"]}
            after = {
                "probability": one["probability"],
                "onset": one["where"]["onset"],
                "offset": one["where"]["offset"],
            }
            rows = [{**row, **after} for row in _estimates(one["parameters"], **of)]
            yield from rows or [{**of, **after}]


def _errors(result: Result) -> Iterable[Row]:
    """Return squared force errors without and with the findings, and their ratio with its interval, by log and axis."""
    for log in _logs(result):
        for axis in AXES:
            ratio = log["after"].get("ratio", {}).get(axis) or {}
            before, after = (log[key].get("mse", {}).get(axis) for key in ("before", "after"))
            if before is not None or after is not None:
                yield {
                    "log": log["log"],
                    "axis": axis,
                    "before": before,
                    "after": after,
                    "ratio": ratio.get("value"),
                } | {end: ratio.get(end) for end in ("low", "high")}


def _withheld(result: Result) -> Iterable[Row]:
    for log in _logs(result):
        for one in log.get("withheld", ()):
            names = dict.fromkeys([*one["found"], *one["measured"]])
            for name in names:
                found = one["found"].get(name, {})
                sizes = {key: found.get(key) for key in ("value", "low", "high")}
                yield {"log": log["log"], "signal": one["signal"], "component": name, **sizes} | {
                    "measured": one["measured"].get(name)
                }


def _alike(result: Result) -> Iterable[Row]:
    for log in _logs(result):
        for pair in (log.get("likeness") or {}).get("pairs", ()):
            first, second = (
                one["effect"] + (f" ({one['instance']})" if one["instance"] else "") for one in pair["effects"]
            )
            yield {"log": log["log"], "first": first, "second": second} | {
                name: value for name, value in pair.items() if name != "effects"
            }


def _scores(scores: Result, **of: Any) -> Iterable[Row]:
    """Return mean square force errors and coefficients of determination of base and model, by axis."""
    for axis in AXES:
        yield (
            {**of, "axis": axis}
            | {
                f"{name}_{which}": scores[name][which].get(axis)
                for name in ("mse", "r2")
                if name in scores
                for which in scores[name]
            }
            | {"ratio": scores.get("per_axis", {}).get(axis)}
        )


def _free_run(runs: Result | None, **of: Any) -> Iterable[Row]:
    for which, run in (runs or {}).items():
        for k, horizon in enumerate(run.get("horizons_s", ())):
            yield {**of, "model": which, "horizon_s": horizon} | {
                name: run[name][k] for name in FREE_RUN if name in run
            }


def _of_logs(rows: Callable[..., Iterable[Row]], key: str | None = None) -> Rows:
    return lambda result: (
        row for log in result["logs"] for row in rows(log if key is None else log.get(key), log=log["name"])
    )


def _differences(result: Result) -> Iterable[Row]:
    for key in ("differences", "compared"):
        for one in result[key]:
            of = {name: one[name] for name in ("effect", "instance", "group")}
            for row in _estimates(one["parameters"], **of):
                yield {
                    **row,
                    "probability": one["probability"],
                    "found": key == "differences",
                    "confirmed": one["confirmed"],
                }


def _loads(result: Result) -> Iterable[Row]:
    for one in result["loads"]:
        for row in _estimates(one["parameters"], effect=one["effect"]):
            yield {**row, "differs": one["differs"], "confirmed": one["confirmed"]}


def _coefficients(kind: str) -> Rows:
    def rows(result: Result) -> Iterable[Row]:
        for one in result["coefficients"][kind]:
            of = {name: value for name, value in one.items() if name != "values"}
            for model, interval in one["values"].items():
                yield {**of, "model": model, **interval}

    return rows


def _terms(result: Result) -> Iterable[Row]:
    for axis in AXES:
        for term, one in result["coefficients"][axis].items():
            yield {"axis": axis, "term": term, **one}


def _batch_findings(result: Result) -> Iterable[Row]:
    for row in result["rows"]:
        for one in (row["diagnose"] or {}).get("findings", ()):
            of = {"log": row["name"], "effect": one["effect"], "instance": one["instance"]}
            for each in _estimates(one["parameters"], **of):
                yield {**each, "probability": one["probability"]}


def _trends(result: Result) -> Iterable[Row]:
    for trend in result["trends"]:
        of = {name: trend[name] for name in ("vessel", "effect", "instance", "parameter")}
        for point in trend["points"]:
            yield {**of, **point}


def _planned(result: Result) -> Iterable[Row]:
    for one in result["coefficients"]:
        yield {name: value for name, value in one.items() if name != "deviation"} | one["deviation"]


TABLES: Mapping[str, Mapping[str, Rows]] = {
    "ferryid.fit": {
        "scores": lambda result: _scores(result["scores"]),
        "free_runs": lambda result: _free_run(result["free_run"]),
        "checks": lambda result: result["acceptance"]["checks"],
        "estimators": _plain("estimators"),
        "logs": _plain("logs", LARGE),
    },
    "ferryid.model": {"coefficients": _terms},
    "ferryid.diagnosis": {
        "findings": _findings,
        "errors": _errors,
        "withheld": _withheld,
        "alike": _alike,
        "logs": lambda result: (
            {"log": one["log"], "verdict": one["verdict"], "duration_s": one.get("duration_s")} for one in _logs(result)
        ),
    },
    "ferryid.versus": {"differences": _differences, "loads": _loads},
    "ferryid.evaluate": {
        "scores": _of_logs(_scores),
        "free_runs": _of_logs(_free_run, "free_run"),
    },
    "ferryid.compare": {
        "ratios": _plain("better"),
        "coefficients": _coefficients("physical"),
        "terms": _coefficients("terms"),
        "models": _plain("models"),
    },
    "ferryid.batch": {
        "logs": _plain("rows", ("fit", "evaluate", "diagnose")),
        "findings": _batch_findings,
        "trends": _trends,
        "changes": _plain("changes"),
    },
    "ferryid.plan": {"coefficients": _planned, "manoeuvres": _plain("manoeuvres")},
    "ferryid.models": {"models": _plain("models")},
}
"""Rows of tables by the form of a result, and by the names of the tables."""
