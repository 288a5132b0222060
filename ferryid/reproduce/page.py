"""The page of a reproduction, from studies that are carried out: nothing is computed here."""

from __future__ import annotations

from collections.abc import Sequence

from ferryid.reproduce.study import Row, Study, Table, high, low, number

HEAD = """# The thesis reproduced

Made by `make thesis` (`ferryid reproduce thesis`): the trials of Aurlien (2021), *Multivariate Modeling and Adaptive Control of
Autonomous Ferries*, flown again in the built-in simulator, logged, and learnt from the logs as from any recording. *Theirs* is
what the thesis states, one trial each; *ours* is the median of {count} runs with other weather and noise, least and greatest in
brackets. No setting was chosen to bring the two together; where they differ, the text says what was found out.
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
    lines = [HEAD.format(count=len(seeds))]
    lines += [f"- [{study.title}](#{study.name})" for study in studies]
    for study in studies:
        lines += section(study, folder)
    return "\n".join(lines) + "\n"


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
    return number(value, "+" if unit == "%" else "")


def _table(table: Table) -> list[str]:
    return [
        table.caption,
        "",
        "| " + " | ".join(table.header) + " |",
        "|" + "---|" * len(table.header),
        *("| " + " | ".join(row) + " |" for row in table.rows),
    ]
