"""The table of a run, and the page made of it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from tests.attack.run import Result

HEADER = (
    "| format | mutation | cases | whole | loss reported | refused | legitimate edits | overstated | violations "
    "| slowest [s] | most memory [MB] |\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"
)


@dataclass
class Tally:
    """Cases of one format and one kind of mutation."""

    cases: int = 0
    results: dict[str, int] = field(default_factory=lambda: {"whole": 0, "loss": 0, "refused": 0})
    legitimate: int = 0
    overstated: int = 0
    violations: int = 0
    seconds: float = 0.0
    memory: int = 0

    def add(self, result: Result) -> None:
        """Count one case."""
        outcome = result.outcome
        self.cases += 1
        self.results[outcome.result] += 1
        self.legitimate += result.legitimate
        self.overstated += outcome.overstated
        self.violations += bool(outcome.violations)
        self.seconds = max(self.seconds, outcome.seconds)
        self.memory = max(self.memory, outcome.memory)

    def row(self, first: str, second: str) -> str:
        """Return the line of the table."""
        cells = [first, second, self.cases, *self.results.values(), self.legitimate, self.overstated, self.violations]
        return "| " + " | ".join(map(str, cells)) + f" | {self.seconds:.2f} | {self.memory / 1e6:.0f} |"


def table(results: Iterable[Result]) -> str:
    """Return the table by format and mutation, with sums."""
    by_kind: dict[tuple[str, str], Tally] = {}
    whole = Tally()
    for result in results:
        by_kind.setdefault((result.format, result.kind), Tally()).add(result)
        whole.add(result)
    lines = [HEADER, *(by_kind[key].row(*key) for key in sorted(by_kind)), whole.row("**all**", "")]
    return "\n".join(lines)


def grouped(results: Iterable[Result]) -> list[tuple[str, str, str, list[Result]]]:
    """Group violations by format, mutation and sentence without its numbers, the most frequent first."""
    groups: dict[tuple[str, str, str], list[Result]] = {}
    for result in results:
        for one in result.outcome.violations:
            text = re.sub(r"\d+", "#", one.replace("without verification: ", "").replace("with verification: ", ""))
            text = re.sub(r"'[^']*'|\([^)]*\)", "…", text) if "Error" not in text[:20] else text.split(": ")[0]
            group = groups.setdefault((result.format, result.kind, text[:140]), [])
            if result not in group:
                group.append(result)
    return sorted(((*key, each) for key, each in groups.items()), key=lambda group: -len(group[3]))


def listed(seed: int, results: Iterable[Result], only: str) -> str:
    """Return violations as a list, one case of each group with the command that repeats it; empty without any."""
    flag = f" --format {only}" if only else ""
    return "\n".join(
        f"- {len(group)} × {form}, {kind}: {text} (`python -m tests.attack --seed {seed} --only {group[0].number}{flag}`)"
        for form, kind, text, group in grouped(results)
    )


def page(runs: Sequence[tuple[int, int, float, str, int]], bases: Sequence[str], not_covered: str) -> str:
    """Return the page in Markdown.

    Parameters
    ----------
    runs
        Seed, number of cases, time [s], table and number of violations of every run.
    bases
        Names of the undamaged logs.
    not_covered
        Section on what is not covered.
    """
    lines = [
        "# Attack on the readers",
        "",
        "Written by `make attack`: logs of every format, damaged and hostile, and what must hold whatever they contain.",
        "`make attack CASES=N SEED=S` repeats a run, `python -m tests.attack --seed S --only N` one case of it.",
        "",
    ]
    for seed, cases, seconds, text, violations in runs:
        lines += [f"## Seed {seed}: {cases} cases in {seconds:.0f} s, {violations} with a violation", "", text, ""]
    lines += [not_covered.strip(), "", "## The undamaged logs", "", *(f"- {name}" for name in bases), ""]
    return "\n".join(lines)
