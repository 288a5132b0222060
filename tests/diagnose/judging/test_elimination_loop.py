"""The loop of the elimination beside judges that are drawn at random: that it ends, and what it may keep."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ferryid.diagnose.judging import backward_elimination
from ferryid.diagnose.judging.thresholds import JUDGING

NAMES = "ABCDE"


def made(names: set[str]) -> Any:
    """Stand in for a fit of these candidates."""
    candidates = tuple(
        SimpleNamespace(key=(name, None), title=name, onset_s=0.0, offset_s=np.inf) for name in sorted(names)
    )
    return SimpleNamespace(candidates=candidates, keys=frozenset(names))


def ended(seed: int, monkeypatch: pytest.MonkeyPatch) -> tuple[int, bool]:
    """Return how many swaps an elimination made, and whether what it keeps was judged to stand."""
    random = np.random.default_rng(seed)
    verdicts = dict[frozenset[str], int | None]()
    swaps = 0

    def fallen(_problem: Any, kept: Any, _proof: Any) -> tuple[int | None, str]:
        """Return always the same of the same set."""
        if kept.keys not in verdicts:
            verdicts[kept.keys] = None if random.random() < 0.1 else int(random.integers(len(kept.candidates)))
        return verdicts[kept.keys], "why"

    def standings(_problem: Any, kept: Any, _library: Any) -> tuple[Any, ...]:
        """Return a rival of each, likelier as often as not."""
        found = []
        for one in kept.candidates:
            left = [name for name in NAMES if name not in kept.keys]
            if not left:
                found.append(SimpleNamespace(rivals=[]))
                continue
            other = str(random.choice(left))
            rival = SimpleNamespace(
                gain=float(random.uniform(-1.0, 1.0)), fit=made((kept.keys - {one.key[0]}) | {other})
            )
            found.append(SimpleNamespace(rivals=[rival]))
        return tuple(found)

    def with_both(_problem: Any, kept: Any, replaced: int, fit: Any) -> Any:
        nonlocal swaps
        swaps += 1
        return made(set(fit.keys) | ({kept.candidates[replaced].key[0]} if random.random() < 0.3 else set()))

    def without(_problem: Any, kept: Any, index: int) -> Any:
        return made(set(kept.keys) - {kept.candidates[index].key[0]})

    for name, stub in {
        "_fallen": fallen,
        "_standings": standings,
        "_sizes": lambda _problem, _kept, _index: "",
        "least_gain": lambda _problem, _kept, _index, _rival: -1.0 if random.random() < 0.2 else 0.0,
        "with_both": with_both,
        "without": without,
        "prune": lambda _problem, kept: kept,
        "held_out_evidence": lambda _problem, _kept: None,
        "without_companions": lambda _problem, _kept, _index, standing: standing,
    }.items():
        monkeypatch.setattr(backward_elimination, name, stub)
    kept = backward_elimination.eliminate_backward(Any, made(set("ABC")), [], lambda _stage: None).fit
    return swaps, not kept.candidates or verdicts[kept.keys] is None


def test_it_ends_with_what_stands_after_few_swaps(monkeypatch: pytest.MonkeyPatch) -> None:
    every = [ended(seed, monkeypatch) for seed in range(2000)]
    assert max(swaps for swaps, _ in every) == JUDGING.most_replacements
    assert all(stands for _, stands in every)
