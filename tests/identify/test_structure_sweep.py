"""Structures compared: each truth is supported by its own logs, twins are not told apart, errors are those of fits to rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from ferryid.errors import FerryIdError
from ferryid.identify import inputs
from ferryid.identify.settings import FitSettings
from ferryid.identify.split import correlation_time
from ferryid.identify.sweeps import structure_sweep as module
from ferryid.identify.sweeps.structure_comparison import (
    Structure,
    StructureComparison,
    StructureSweep,
    over_base,
    structures_json,
)
from ferryid.identify.sweeps.structure_sweep import sweep_structures, usable_bases
from ferryid.models.forces.residual import compute_residual
from ferryid.regression.bases.basis import STRUCTURES, Basis, make_basis, with_hull_length
from ferryid.regression.bases.forms import basis_names
from ferryid.report.structures_text import render_structures, supported_structure
from ferryid.signals.prepare import Opened, open_track
from ferryid.signals.smooth import Measured, smooth_measured
from ferryid.signals.track import Motion
from ferryid.types import RunContext
from tests.identify.rounds import PROFILE, RATE_HZ, recorded_as
from tests.identify.trials import measured

pytestmark = pytest.mark.slow

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

FIXTURES = Path(__file__).resolve().parents[2] / "fixtures"
SETTINGS = FitSettings(estimator="derivative")
Run = Callable[..., StructureSweep]
NAMELESS = replace(PROFILE, hull=replace(PROFILE.hull, length_m=float("nan")), path="boat.toml")


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Opened:
    return open_track(str(FIXTURES / "short.mcap"), PROFILE, tmp_path_factory.mktemp("out"))


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, opened: Opened) -> Run:
    """Return a function that compares structures on logs made in memory."""

    def compare(
        logs: Sequence[Measured], settings: FitSettings = SETTINGS, profile=PROFILE, folds: int = 5
    ) -> StructureSweep:  # type: ignore[no-untyped-def]
        ready = {
            log.log: replace(
                opened,
                measured=log,
                recording=recorded_as(opened.recording, log.log),
            )
            for log in logs
        }
        monkeypatch.setattr(inputs, "open_track", lambda path, *_, **__: ready[path])
        return sweep_structures(list(ready), profile, settings, RunContext(Path("nowhere")), folds=folds)

    return compare


def functions_of(name: str, structure: str) -> Basis:
    return make_basis(with_hull_length(name, PROFILE.hull.length_m, "test"), structure=structure)


def logs_of(name: str, structure: str, count: int = 1, seconds: float = 900.0, noise: float = 100.0) -> list[Measured]:
    """Logs of a hull with forces of one structure beside its own."""
    functions = functions_of(name, structure)
    rng = np.random.default_rng(7)
    theta = rng.uniform(150.0, 450.0, functions.mask.shape) * rng.choice([-1.0, 1.0], functions.mask.shape)
    theta *= functions.mask
    theta[[term.endswith("_dot") for term in functions.terms]] = 0.0

    def force(made: Motion) -> Floats:
        return functions.of(made) @ theta

    return [measured(seed, seconds=seconds, jitter=0.002, noise=noise, force=force) for seed in range(count)]


def find(one: StructureComparison, name: str, structure: str) -> Structure:
    return next(each for each in one.structures if (each.basis, each.structure) == (name, structure))


@pytest.mark.parametrize("structure", STRUCTURES)
@pytest.mark.parametrize("name", basis_names())
def test_a_truth_is_supported_by_its_own_logs(run: Run, name: str, structure: str) -> None:
    one = run(logs_of(name, structure)).by["blocks"]
    assert find(one, name, structure).kept
    # The thesis's functions are those of modulus, three of them twice: the same with fewer coefficients.
    told = one.supported
    assert (told.basis, told.structure) == ("modulus" if name == "thesis" else name, structure)
    poorer = "cross-flow" if name == "second-order" else "second-order"
    assert not find(one, poorer, "decoupled").kept
    if structure == "coupled":
        assert not any(each.kept for each in one.structures if each.structure == "decoupled")


@pytest.mark.parametrize("components", ["auto", 40])
def test_twins_are_not_told_apart(run: Run, components: str | int) -> None:
    one = run(logs_of("modulus", "decoupled"), replace(SETTINGS, components=components)).by["blocks"]
    modulus, thesis = (find(one, name, "decoupled") for name in ("modulus", "thesis"))
    assert modulus.kept
    assert thesis.kept
    assert one.supported is modulus
    if components == 40:
        np.testing.assert_allclose(thesis.mse, modulus.mse, rtol=1e-9)
        assert (modulus.p, thesis.p) == (1.0, 1.0)
        assert one.structures.index(modulus) < one.structures.index(thesis)


def test_noise_alone_supports_the_simplest(run: Run) -> None:
    """Where the base model is true there is nothing to tell structures apart by."""
    found = run([measured(3, seconds=300.0, noise=200.0)])
    assert found.by["blocks"].supported is found.by["blocks"].simplest
    assert (found.by["blocks"].simplest.basis, found.by["blocks"].simplest.structure) == ("cross-flow", "decoupled")
    assert not found.by["blocks"].any_beats_base
    told = supported_structure(found.by["blocks"])
    assert told.startswith(
        "No structure beats the base model: keep it as it is. Of the structures alone, the data support cr"
    )


def rows_of_blocks(used: Flags, blocks: int, purge: int, folds: int) -> list[tuple[int, Flags]]:
    """Fold and test rows of every block, row by row."""
    order = np.flatnonzero(used)
    number = np.arange(len(order)) * blocks // len(order)
    cut = []
    for block in range(blocks):
        fold = block * folds // blocks
        kept = np.zeros(len(used), dtype=bool)
        mine = order[number == block]
        theirs = order[number * folds // blocks != fold]
        for row in mine:
            kept[row] = np.abs(theirs - row).min() > purge
        cut.append((fold, kept))
    return cut


def test_errors_and_intervals_are_those_of_fits_from_scratch(run: Run) -> None:
    log = logs_of("lift", "decoupled", seconds=400.0, noise=300.0)[0]
    one = run([log], replace(SETTINGS, components=40, inertia="fitted")).by["blocks"]
    motion = smooth_measured(log, 1.0)
    error = compute_residual(PROFILE, motion, SETTINGS.scale)
    cut = rows_of_blocks(motion.valid, one.blocks, round((1.0 + 2.0 / RATE_HZ + 2.0) * RATE_HZ), 5)
    assert one.rows == sum(rows.sum() for _, rows in cut)
    squares = {}
    for name in ("modulus", "lift", "cross-flow"):
        functions = functions_of(name, "decoupled")
        X = np.column_stack([functions.of(motion), np.ones(len(motion.t))])
        errors = np.zeros((len(cut), 3))
        for number, (fold, rows) in enumerate(cut):
            training = np.any([other for f, other in cut if f != fold], axis=0)
            for axis in range(3):
                columns = np.append(functions.mask[:, axis], True)
                theta = np.linalg.lstsq(X[training][:, columns], error[training, axis], rcond=None)[0]
                errors[number, axis] = ((error[rows, axis] - X[rows][:, columns] @ theta) ** 2).sum()
        squares[name] = errors
        mse = errors.sum(axis=0) / one.rows
        np.testing.assert_allclose(find(one, name, "decoupled").mse, mse, rtol=1e-7)
    best = one.structures[0]
    assert (best.basis, best.structure) == ("lift", "decoupled")
    # Percentiles of blocks drawn again, by another generator.
    picked = np.random.default_rng(99).integers(0, len(cut), (4000, len(cut)))
    for name in ("modulus", "cross-flow"):
        ratios = squares[name][picked].sum(axis=1) / squares["lift"][picked].sum(axis=1)
        low, high = np.quantile(ratios, [0.025, 0.975], axis=0)
        against = find(one, name, "decoupled").against_best
        np.testing.assert_allclose(against.value, squares[name].sum(axis=0) / squares["lift"].sum(axis=0), rtol=1e-7)
        # Those of few blocks are moved out a little.
        np.testing.assert_allclose((against.value - against.low) / (against.value - low), 1.08, atol=0.15)
        np.testing.assert_allclose((against.high - against.value) / (high - against.value), 1.08, atol=0.15)
    simplest = find(one, "modulus", "decoupled").against_simplest
    assert (one.simplest.basis, one.simplest.structure) == ("cross-flow", "decoupled")
    np.testing.assert_allclose(
        simplest.value, squares["modulus"].sum(axis=0) / squares["cross-flow"].sum(axis=0), rtol=1e-7
    )


def test_test_rows_do_not_choose_components(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rows of one fold spoilt in force: the number that the others choose without it must not change."""
    log = logs_of("modulus", "decoupled", seconds=600.0, noise=300.0)[0]
    rows = len(log.t)
    # The middle of the third of five folds, so that smoothing does not carry over.
    spoilt = (np.arange(rows) > 0.45 * rows) & (np.arange(rows) < 0.55 * rows)
    shaken = np.where(spoilt[:, None], log.tau + 3000.0 * np.sin(np.arange(rows) * 0.7)[:, None], log.tau)
    settings = replace(SETTINGS, inertia="fitted")
    monkeypatch.setattr(module, "block_length", lambda *_: 20.0)
    honest, other = (run([one], settings).by["blocks"] for one in (log, replace(log, tau=shaken)))
    within = {(each.basis, each.structure): each.within for each in other.structures}
    for each in honest.structures:
        assert each.within[2] == within[each.basis, each.structure][2]
    assert any(each.within != within[each.basis, each.structure] for each in honest.structures)


def test_blocks_are_as_long_as_residuals_remember(run: Run) -> None:
    quick = run([measured(1, seconds=900.0, noise=100.0)])
    rng = np.random.default_rng(0)

    def swell(made: Motion) -> Floats:
        """A force with a memory of 20 s, which no function of motion explains."""
        white = rng.normal(0.0, 300.0, (len(made.t), 3))
        slow = np.zeros_like(white)
        for k in range(1, len(white)):
            slow[k] = slow[k - 1] * (1.0 - 0.1 / 20.0) + white[k] * 0.1
        return slow

    log = measured(1, seconds=900.0, force=swell)
    slow = run([log])
    motion = smooth_measured(log, 1.0)
    remembers = correlation_time(compute_residual(PROFILE, motion, SETTINGS.scale), motion.valid, RATE_HZ)
    assert remembers > 8.0
    assert slow.block_s > 10.0 > quick.block_s
    assert slow.by["blocks"].blocks >= 20
    short = run([measured(1, seconds=100.0, force=swell)])
    assert short.by["blocks"].blocks < 20
    assert any("independent stretches to draw from" in note for note in short.notes)


def test_whole_logs(run: Run) -> None:
    found = run(logs_of("second-order", "decoupled", count=3, seconds=300.0))
    one = found.by["logs"]
    assert one.folds == 3
    assert (one.supported.basis, one.supported.structure) == ("second-order", "decoupled")
    assert any("these days' own" in note for note in found.notes)
    assert all(len(each.within) == 3 for each in one.structures)
    assert run(logs_of("modulus", "decoupled", count=7, seconds=60.0)).by["logs"].folds == 7
    two = run(logs_of("second-order", "decoupled", count=2, seconds=300.0))
    assert two.by["logs"].folds == 2
    assert any(note.startswith("With two folds the number of components was chosen on both") for note in two.notes)


def test_a_basis_that_cannot_be_used_is_listed(run: Run) -> None:
    logs = logs_of("modulus", "decoupled", seconds=200.0)
    found = run(logs, profile=NAMELESS)
    assert list(found.unusable) == ["cross-flow"]
    assert "boat.toml: the basis cross-flow needs the hull's length" in found.unusable["cross-flow"]
    assert {each.basis for each in found.by["blocks"].structures} == set(basis_names()) - {"cross-flow"}
    assert "left out: cross-flow: boat.toml" in render_structures(found)
    given = run(logs, replace(SETTINGS, basis="cross-flow-4m"), NAMELESS)
    assert given.unusable == {}
    assert find(given.by["blocks"], "cross-flow", "coupled").functions.name == "cross-flow-4m"


def test_names_of_bases_with_wind() -> None:
    usable, unusable = usable_bases(FitSettings(basis="modulus+wind-paper"), PROFILE)
    assert unusable == {}
    assert usable["lift"] == "lift+wind-paper"
    assert usable["cross-flow"] == "cross-flow-5m+wind-paper"


def test_inertia_that_a_fit_would_hold_is_held(run: Run) -> None:
    log = measured(1, noise=5.0)
    forceless = replace(log, tau=log.tau * [1.0, 0.0, 1.0])
    found = run([forceless])
    for each in found.by["blocks"].structures:
        assert each.held.tolist() == [False, True, False]
        assert not each.allowed[[each.functions.terms.index(name) for name in ("v_dot", "r_dot")], 1].any()
    held = structures_json(found)["by"]["blocks"]["structures"][0]["held_inertia"]
    assert held == ["sway"]


def test_all_terms_may_be_components(run: Run) -> None:
    one = run(logs_of("lift", "coupled", seconds=300.0), replace(SETTINGS, components=40)).by["blocks"]
    assert find(one, "lift", "coupled").components == 26
    assert find(one, "modulus", "decoupled").components == 18


def test_what_is_told_is_what_was_found(run: Run) -> None:
    found = run(logs_of("lift", "decoupled", seconds=400.0))
    one = found.by["blocks"]
    lines = render_structures(found).splitlines()
    size = f"with {one.supported.coefficients} free coefficients"
    assert lines[0].startswith(f"The data support lift, decoupled, {size}: ")
    assert one.supported.coefficients == functions_of("lift", "decoupled").mask.sum()
    start = next(i for i, line in enumerate(lines) if line.startswith("  basis")) + 1
    for line, each in zip(lines[start:], one.structures, strict=False):
        mark = "*" if each is one.supported else "·" if each.kept else " "
        assert line.startswith(f"{mark} {each.basis}")
        cells = line[2:].split()
        assert cells[1:4] == [each.structure, "/".join(map(str, each.allowed.sum(axis=0))), str(each.components)]
        np.testing.assert_allclose([float(cell) for cell in cells[4:7]], over_base(each, one), atol=6e-5)
        assert float(cells[7]) == pytest.approx(each.score, abs=6e-5)
    plain = structures_json(found)
    assert plain["choice"] == {"basis": "lift", "structure": "decoupled"}
    assert [each["score"] for each in plain["by"]["blocks"]["structures"]] == [each.score for each in one.structures]


def test_verdict_when_all_are_kept_and_when_one_is(run: Run) -> None:
    one = run([measured(3, seconds=200.0, noise=200.0)]).by["blocks"]
    alone = replace(one, structures=tuple(replace(each, p=float(i == 0)) for i, each in enumerate(one.structures)))
    every = replace(one, structures=tuple(replace(each, p=1.0) for each in one.structures))
    some = replace(one, structures=tuple(replace(each, p=float(i < 4)) for i, each in enumerate(one.structures)))
    assert "better than every other of 10 structures" in supported_structure(alone)
    assert one.structures[0].title in supported_structure(alone)
    assert "of all 10 structures, as none is significantly worse than the best" in supported_structure(every)
    fewest = min(some.structures[:4], key=lambda each: each.coefficients)
    assert f"data support {fewest.title}, with {fewest.coefficients} free" in supported_structure(some)
    assert "of the 4 of 10 structures" in supported_structure(some)


def test_what_cannot_be_compared(run: Run) -> None:
    with pytest.raises(FerryIdError, match=r"--folds: 1 is no number of folds.*Fix: "):
        run([measured(1)], folds=1)
    with pytest.raises(FerryIdError, match=r"round 1: cross-validation needs two folds.*Fix: "):
        run([measured(1, seconds=9.0)])
