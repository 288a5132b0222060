"""The page of a reproduction, from studies that are carried out: nothing is computed here."""

from __future__ import annotations

from collections.abc import Sequence

from ferryid.counts import counted
from ferryid.reproduce.study import Row, Study, Table, high, low, number, percent

HEAD = """# The thesis reproduced

Made by `make thesis` (`ferryid reproduce thesis`): the trials of Aurlien (2021), *Multivariate Modeling and Adaptive Control of
Autonomous Ferries*, flown again in the built-in simulator, logged, and fitted to the logs as from any recording. *Theirs* is
what the thesis states, one trial each; *ours* is the median of {runs} with other weather and noise, least and greatest in
brackets. No setting was chosen to bring the two together; where they differ, the text says what was found out. What the
thesis leaves open and we had to choose stands [at the end](#chosen).
"""

CHOSEN = """<a id="chosen"></a>
## What was chosen, and when

The thesis gives the hull, the thrust curve, the path, the base model, the noise of Table 5.2, and the weather in words. Chosen
by us were:

- with the scenarios, before the studies were run: wind and gusts of Experiment 1 (5 m/s, 1.67 m/s; the thesis estimates 0 to
  10 m/s from NW) and the gusts of Experiment 2 (0.3 m/s); heights, periods and times of waves and wakes, and the factor 3 for
  round 8; the payload of 480 kg; how position and heading make one error e. Feedback gains, reference filter, the thrusters'
  lags and the colour of the noise are the simulator's defaults;
- after first results had been seen, to find out why they differ from the thesis: another round of Experiment 1 and calm
  weather as test logs of the tuning study, how speed through a turn is measured for the guidance laws, and the studies *How
  wrong is the Master Model?* and *What these comparisons hang on*. The scenario of Experiment 3 was written at that time too;
- after a first version of this page: in calm weather the 1.0 s window, the Master Model's rounds in the same noise, the rounds
  without noise and the true signals put into a log; the true hull plus a constant force in Experiment 1; wrong hulls without
  wind; smaller waves in the tuning study's test log; the log without a breeze for `ferryid fit`; the third functions of the
  wind, and rounds with measured wind; the number of runs, as many as fit the time that making this page may take.

The repository's history begins with scenarios and studies in one commit, so that it cannot show which came first; the
scenarios of Experiments 1 and 2 and of calm weather have not been changed since.
"""


def page(studies: Sequence[Study], seeds: Sequence[int], folder: str) -> str:
    """Return the page as Markdown.

    Parameters
    ----------
    studies
        In the order of the page.
    seeds
        What they were repeated with.
    folder
        Where the figures lie, as seen from the page.
    """
    lines = [HEAD.format(runs=counted(len(seeds), "run")), *summary(studies)]
    lines += [f"- [{study.title}](#{study.name})" for study in studies]
    lines += ["- [What was chosen, and when](#chosen)"]
    for study in studies:
        lines += section(study, folder)
    lines += ["", CHOSEN]
    return "\n".join(lines) + "\n"


def summary(studies: Sequence[Study]) -> list[str]:
    """Return what became of the thesis's numbers, as lines of Markdown; rows without a number of theirs do not count."""
    lines = [
        "| of the thesis's numbers | within the range of our runs | outside, same direction | other |",
        "|---|---|---|---|",
    ]
    for study in studies:
        met = [_met(row.theirs, row) for row in study.rows if isinstance(row.theirs, int | float)]
        if met:
            counts = (met.count(kind) for kind in ("within", "direction", "other"))
            lines.append(f"| [{study.title}](#{study.name}): {len(met)} | " + " | ".join(map(str, counts)) + " |")
    return [*lines, ""] if len(lines) > 2 else []


def _met(theirs: float, row: Row) -> str:
    if low(row.ours) <= theirs <= high(row.ours):
        return "within"
    return "direction" if row.unit == "%" and theirs * row.median > 0.0 else "other"


def section(study: Study, folder: str) -> list[str]:
    """Return one study as lines of Markdown."""
    lines = ["", f'<a id="{study.name}"></a>', f"## {study.title}", "", f"**{study.question}**", ""]
    lines += [*study.method, ""]
    if study.rows:
        lines += ["| | theirs | ours |", "|---|---|---|", *(_row(row) for row in study.rows), ""]
    for table in study.tables:
        lines += [*_table(table), ""]
    lines += [f"- {finding}" for finding in study.findings]
    for drawing in study.drawings:
        lines += ["", f"![{drawing.caption}]({folder}/{drawing.name}.svg)", "", f"*{drawing.caption}*"]
    return lines


def _row(row: Row) -> str:
    theirs = "–" if row.theirs is None else row.theirs if isinstance(row.theirs, str) else _with(row.theirs, row.unit)
    ours = _with(row.median, row.unit)
    if len(row.ours) > 1:
        ours += f" ({_plain(low(row.ours), row.unit)} to {_plain(high(row.ours), row.unit)})"
    return f"| {row.quantity} | {theirs} | {ours} |"


def _with(value: float, unit: str) -> str:
    return f"{_plain(value, unit)} {unit}".rstrip()


def _plain(value: float, unit: str) -> str:
    return percent(value) if unit == "%" else number(value)


def _table(table: Table) -> list[str]:
    return [
        table.caption,
        "",
        "| " + " | ".join(table.header) + " |",
        "|" + "---|" * len(table.header),
        *("| " + " | ".join(row) + " |" for row in table.rows),
    ]
