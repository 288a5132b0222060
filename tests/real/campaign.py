"""Campaigns with a withheld wind or without any environment: reports/campaign.md."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ferryid.compare import evaluate
from ferryid.diagnose.judging.campaign_conditions import ConditionTest
from ferryid.diagnose.judging.campaign_evidence import EXCHANGED, MIRRORED, SHIFTED, Gain
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.thresholds import JUDGING
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
from ferryid.models.store import load
from ferryid.types import AXES, IN_MEMORY, Flags, RunContext
from ferryid.vessel import load_profile
from ferryid.vessel.profile import Profile
from tests.evidence import stamp
from tests.real import aauship, causes, changes, days, esso, groups, instruments, times, withheld
from tests.real.places import DATA, REPORTS

ENVIRONMENT = ("wind", "current", "waves", "mooring", "gusts", "shallow_water")
TANK, POOL = "kvlcc2/*.dat", "vtec_usv/*.bag"
NAMED, HELD, SHARE = 8 / 9, 0.85, 0.5
"""Aims: runs whose wind is named, components inside the intervals, and of the measured wind's held-out gain."""
MEDIAN_DEG, STRENGTH, NEAR_DEG, NEAR_RUNS, WRONG_DEG = 10.0, (0.8, 1.2), 30.0, 6 / 9, 60.0


@dataclass(frozen=True)
class Aim:
    """What was aimed at, what came out, whether that reaches it, and why not, as far as figures show it."""

    what: str
    aim: str
    figure: str
    reached: bool
    cause: str = ""


def write() -> None:
    """Estimate and judge every campaign and write the page."""
    began = time.monotonic()
    load = os.getloadavg()[0]
    parts = [HEAD, command(), times.section()]
    hidden = list[dict[str, Any]]()
    for kind, title in (("random", "Random runs"), ("zigzag", "Zigzags"), ("all", "All runs")):
        print(title, flush=True)
        study = esso.study(kind)
        hidden += withheld.winds(study, title)
        if kind == "random":
            random = winds_of(study, study.of(kind))
        parts.append(section(study, title, None if kind == "random" else random))
    print("Sessions", flush=True)
    parts.append(days.section())
    print("KVLCC2, VTec", flush=True)
    parts += [tank(), pool()]
    print("AAUSHIP", flush=True)
    parts.append(aauship.section())
    print("Groups of logs, other instruments", flush=True)
    others = instruments.sources()
    parts += [groups.section(), changes.section(), instruments.section(others)]
    withheld.store(hidden, others, REPORTS)
    minutes = (time.monotonic() - began) / 60.0
    parts.append(
        f"\nMade in {minutes:.0f} minutes on {os.cpu_count()} processors with a load of {load:.1f} at the start.\n"
    )
    page = REPORTS / "campaign.md"
    page.write_text("\n".join(parts), encoding="utf-8")
    stamp(page)


HEAD = """# Campaigns: one hull, and conditions of every log

Made by `make campaign` with the recordings at hand (they are not part of the project) and the default settings. A campaign is
several logs of one vessel: hull, conditions as random effects and coloured noise are estimated together, and a condition is
confirmed over all logs by held-out blocks ([Several logs](../docs/diagnosis.md#several-logs)).

Esso Osaka, a 3 m tanker model on a pond, measured the wind. It is withheld here, and the profile has no hull model. Winds are
given where the air goes to. The *measured* wind is the mean of the channel over a run, beside its standard deviation over time;
the *estimate* stands with the standard error that the tool reports. *Named* is a finding with a probability above 0.5, a *hint*
one with less. Held-out gains are log-likelihoods [nat] over no condition at all, with 95 % block-bootstrap intervals, all under
the noise of the estimate with a wind.

**Controls** are the same runs with conditions on the mirrored heading or on that of another run, and judged as the true ones
are, against placebos of their own. The mirrored heading of the mirrored one is the true heading.
"""


def command() -> str:
    """Return the section on the whole command, run on the random runs."""
    logs = esso.logs("random")
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as out:
        made = subprocess.run(
            [
                *(str(Path(sys.executable).with_name("ferryid")), "diagnose", *logs, "--vessel", "esso-osaka"),
                *("--withhold", "wind", "--out", out, "--json", str(Path(out) / "found.json")),
            ],
            capture_output=True,
            text=True,
            check=False,
        )
        assert made.returncode == 0, made.stderr
        seconds = time.monotonic() - began
        whole = json.loads((Path(out) / "found.json").read_text(encoding="utf-8"))
        found, stored = whole["logs"], _stored(whole, out)
    lines = ["| log | verdict | named | hints |", "|---|---|---|---|"]
    for one in found:
        sure, less = (
            ", ".join(dict.fromkeys(each["effect"] for each in one["findings"] if _sure(each["probability"]) == way))
            for way in (True, False)
        )
        lines.append(f"| {one['log']} | {one['verdict']} | {sure} | {less} |")
    winds = sum(
        any(each["effect"] == "wind" and _sure(each["probability"]) for each in one["findings"]) for one in found
    )
    return "\n".join(
        [
            "\n## The whole command on the random runs\n",
            f"`ferryid diagnose LOG... --vessel esso-osaka --withhold wind` on {len(logs)} runs takes {seconds:.0f} s, the "
            f"report included, and names a wind in {winds} of {len(found)}.",
            "",
            *lines,
            "",
            *stored,
        ]
    )


def _stored(found: dict[str, Any], out: str) -> list[str]:
    """Return what the stored model is worth: on held-out windows, and in free runs of zigzags that it did not see."""
    learned, model = found["learned"], found["model"]
    if model is None:
        return [f"No model is stored. {learned['says']}"]
    lines = [f"One model is stored, with the wind of {len(found['logs'])} logs. {learned['says']}"]
    if learned["over_fit"]:
        over = ", ".join(f"{axis} {learned['over_fit'][axis]:.2f}" for axis in AXES)
        lines += [
            "",
            f"Its squared prediction error over that of the model of `ferryid fit` on the same held-out windows: {over}.",
        ]
    run = evaluate(load(model, Path(out)), esso.logs("zigzag"), RunContext(Path(out)))
    horizons = run["logs"][0]["free_run"]["base"]["horizons_s"]
    ratios = [
        np.array(one["free_run"]["model"]["position_m"], dtype=float)
        / np.array(one["free_run"]["base"]["position_m"], dtype=float)
        for one in run["logs"]
    ]
    median = ", ".join(
        f"{value:.2f} after {horizon:g} s"
        for value, horizon in zip(np.nanmedian(ratios, axis=0), horizons, strict=True)
    )
    lines += [
        "",
        f"Free runs of the {len(ratios)} zigzags, which it did not see: position error over the base model's, "
        f"median of the runs: {median}.",
    ]
    return lines


def _sure(probability: float) -> bool:
    return probability > JUDGING.hint_probability


def winds_of(study: esso.Study, of: Flags) -> causes.Winds:
    """Return the winds of some runs, shape (runs,), and how far the vessel turned in them."""
    members = study.found.wind.fit.campaign.members
    turns = [causes.spread_deg(one.windows.measurements.psi[one.windows.measurements.usable]) for one in members]
    return causes.Winds(study.measured[of], study.found.winds[of], study.found.errors[of], np.array(turns)[of])


def section(study: esso.Study, title: str, beside: causes.Winds | None = None) -> str:
    """Return the section on one set of runs, `beside` those of the random runs by themselves."""
    lines = [f"\n## {title}\n", *wind_table(study), "", *_apart(study), "", *_tests(study), "", *_gains(study), ""]
    lines += [*_controls(study), "", "| aim | | figure | |", "|---|---|---|---|"]
    found = aims(study, beside)
    for one in found:
        lines.append(f"| {one.what} | {one.aim} | {one.figure} | {'reached' if one.reached else '**missed**'} |")
    lines += [f"\nMissed, {one.what}: {one.cause}" for one in found if not one.reached and one.cause]
    return "\n".join(lines)


def wind_table(study: esso.Study) -> list[str]:
    """Return the winds of all runs, measured and estimated, as lines."""
    found = study.found
    off, strength, inside = (part(study.measured) for part in (found.off, found.strength, found.inside))
    lines = [
        f"{len(study.names)} runs, which differ about the hull by {found.wind.fit.disagreement:.1f} times the variance of "
        "their noise; reported errors are widened by it.",
        "",
        "| run | measured: north, east [m/s] | over time | estimate ± standard error [m/s] | off by [deg] | strength, "
        "estimate over measured | components in the interval | correlation over time | measured rows in the band | wind |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for k, name in enumerate(study.names):
        cells = [
            name,
            "{:.2f}, {:.2f}".format(*study.measured[k]),
            "{:.2f}, {:.2f}".format(*study.unsteady[k]),
            ", ".join(f"{a:.2f} ± {b:.2f}" for a, b in zip(found.winds[k], found.errors[k], strict=True)),
            f"{off[k]:.0f}",
            f"{strength[k]:.2f}",
            f"{inside[k].sum()} of 2",
            f"{study.over_time[k].correlation:.2f}" if study.over_time else "",
            f"{100.0 * study.over_time[k].inside:.0f} %" if study.over_time else "",
            "named" if found.has_wind[k] else "hint" if "wind" in found.hinted[k] else "",
        ]
        lines.append(f"| {' | '.join(cells)} |")
    if study.over_time:
        correlation = float(np.median([one.correlation for one in study.over_time]))
        inside = float(np.mean([one.inside for one in study.over_time]))
        lines += [
            "",
            f"Over time, the estimated course correlates with the withheld measurement by {correlation:.2f} in the median, and "
            f"its 95 % band holds {100.0 * inside:.0f} % of the measured rows.",
        ]
    return lines


def aims(study: esso.Study, beside: causes.Winds | None = None) -> list[Aim]:
    """Return the aims that a set of runs has: those of the random runs, of the zigzags, and of every set.

    `beside` are the winds of the random runs by themselves, with which causes are compared.
    """
    found, made = study.found, []
    off, strength, named = found.off(study.measured), found.strength(study.measured), found.has_wind
    of = study.of("random")
    if of.any():
        apart, ratio = float(np.median(off[of])), float(np.median(strength[of]))
        low, high = STRENGTH
        made += [
            Aim(
                "random runs: wind named", "8 of 9", f"{named[of].sum()} of {of.sum()}", bool(named[of].mean() >= NAMED)
            ),
            Aim(
                "random runs: median angle off",
                f"at most {MEDIAN_DEG:.0f} deg",
                f"{apart:.0f} deg",
                apart <= MEDIAN_DEG,
                causes.of_the_median(winds_of(study, of)),
            ),
            Aim("random runs: median strength", f"{low} to {high}", f"{ratio:.2f}", low <= ratio <= high),
        ]
    of = study.of("zigzag")
    if of.any():
        near = off[of] <= NEAR_DEG
        made.append(
            Aim(
                f"zigzags: within {NEAR_DEG:.0f} deg",
                "6 of 9",
                f"{near.sum()} of {of.sum()}",
                bool(near.mean() >= NEAR_RUNS),
                " ".join(
                    [
                        causes.of_directions(winds_of(study, of), NEAR_DEG, NEAR_RUNS, beside),
                        *(
                            []
                            if study.shared is None
                            else [causes.of_the_vessel(study.shared, study.measured, NEAR_DEG)]
                        ),
                    ]
                ),
            )
        )
    wrong = int(np.sum(named & (off > WRONG_DEG)))
    held = float(found.inside(study.measured).mean())
    whole = study.gains[esso.MEASURED].total
    share = found.wind.gain.total / whole
    means = (study.gains[esso.MEAN].total / whole, study.gains[esso.MEAN + esso.SCALED].total / whole)
    made += [
        Aim(f"named, and more than {WRONG_DEG:.0f} deg off", "none", str(wrong), wrong == 0),
        Aim(
            "measured components inside 95 % intervals",
            f"{100.0 * HELD:.0f} % or more",
            f"{100.0 * held:.0f} %",
            held >= HELD,
            causes.of_intervals(winds_of(study, study.of("all"))),
        ),
        Aim(
            "of the measured wind's held-out gain",
            f"{100.0 * SHARE:.0f} %",
            f"{100.0 * share:.0f} %",
            share >= SHARE,
            causes.of_the_gain(*means, SHARE),
        ),
    ]
    for name, one in study.controls.items():
        count = sum(bool(effects) for effects in one.named)
        made.append(Aim(f"control, {name}: runs with anything named", "none", str(count), count == 0))
    return made


def _apart(study: esso.Study) -> list[str]:
    """Return how far runs differ: an estimate that takes after the others is no proof of a wind of each run's own."""
    measured, found = study.measured, study.found.winds
    mean = np.broadcast_to(found.mean(axis=0), found.shape)
    own, common = (float(np.sqrt(np.mean((one - measured) ** 2))) for one in (found, mean))
    between = "; ".join(
        f"{name} {one.std(axis=0)[0]:.2f} north, {one.std(axis=0)[1]:.2f} east"
        for name, one in (("measured", measured), ("estimated", found))
    )
    return [
        f"Standard deviation between runs [m/s]: {between}. Root mean square error of the estimates {own:.2f} m/s, of their "
        f"mean over all runs in the place of each {common:.2f} m/s."
    ]


def _tests(study: esso.Study) -> list[str]:
    lines = [
        "| condition | log evidence over none [nat] | held-out gain [nat] | over the placebo on the mirrored heading: "
        "evidence; gain | on another log's heading | on the heading at other times | |",
        "|---|---|---|---|---|---|---|",
    ]
    return lines + [
        f"| {one.effect} | {one.evidence:+.0f} | {_range(one.gain)} | {_over(one)} | "
        f"{'confirmed' if one.confirmed else 'not confirmed'} |"
        for one in study.found.tests
    ]


def _over(test: ConditionTest) -> str:
    places = (MIRRORED, EXCHANGED, SHIFTED)
    made = (test.placebos.get(one) for one in places)
    return " | ".join("" if one is None else f"{one.evidence:+.0f}; {_range(one.gain)}" for one in made)


def _gains(study: esso.Study) -> list[str]:
    whole = study.gains[esso.MEASURED].total
    rows = {"estimated, steady in every run": study.found.wind.gain, **study.gains}
    factors = ", ".join(f"{axis} {one:.2f}" for axis, one in zip(AXES, study.found.factors, strict=True))
    lines = [
        f"Factors on the profile's wind load that are estimated for all runs: {factors}.",
        "",
        "| wind | held-out gain [nat] | of the measured wind's |",
        "|---|---|---|",
    ]
    return lines + [f"| {name} | {_range(one)} | {100.0 * one.total / whole:.0f} % |" for name, one in rows.items()]


def _controls(study: esso.Study) -> list[str]:
    lines = [
        "| control | condition | log evidence over none [nat] | held-out gain [nat] | over its own placebo on the mirrored "
        "heading: evidence; gain | on another log's heading | on the heading at other times | named in | hint in |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, control in study.controls.items():
        for one in control.tests:
            named, hinted = (sum(one.effect in each for each in part) for part in (control.named, control.hinted))
            lines.append(
                f"| {name} | {one.effect} | {one.evidence:+.0f} | {_range(one.gain)} | {_over(one)} | {named} | {hinted} |"
            )
    return lines


def _range(gain: Gain) -> str:
    return f"{gain.total:+.0f} ({gain.low:+.0f} to {gain.high:+.0f})"


def tanker_with_areas() -> Profile:
    """Return KVLCC2 with wind areas, scaled from those of Esso Osaka, and as if nobody knew that it was in a tank.

    Otherwise no wind or current could be named.
    """
    tanker, other = load_profile("kvlcc2-model"), load_profile("esso-osaka")
    assert other.wind is not None
    scale = (tanker.hull.length_m / other.hull.length_m) ** 2
    areas = replace(
        other.wind,
        frontal_m2=scale * other.wind.frontal_m2,
        lateral_m2=scale * other.wind.lateral_m2,
        length_m=tanker.hull.length_m,
    )
    return replace(tanker, wind=areas, setting="")


def tank() -> str:
    """Return the section on the towing tank."""
    logs = [str(path) for path in sorted(DATA.glob(TANK))]
    rows, reached, notes = [], True, []
    for name, each in (("each by itself", True), ("all together", False)):
        began = time.monotonic()
        made = diagnose(logs, tanker_with_areas(), DiagnosisSettings(each=each), IN_MEMORY)
        seconds = time.monotonic() - began
        sure, hinted = _environment(made)
        reached = reached and not sure and not hinted
        rows.append(f"| {name} | {len(made)} | {_listed(sure)} | {_listed(hinted)} | {seconds:.0f} |")
        if not each:
            notes = [
                f"- {note.replace(f'{DATA}/', '')}" for note in made[0].notes if all(note in one.notes for one in made)
            ]
    return "\n".join(
        [
            "\n## KVLCC2 in a towing tank\n",
            "Five zigzags without wind, waves or current. The profile was given wind areas, so that a wind can be named; the "
            "aim is that none of wind, current, waves, moorings, gusts and shallow water is named or a hint: "
            f"{'reached' if reached else '**missed**'}.",
            "",
            "| diagnosed | logs | environment named | environment as a hint | time [s] |",
            "|---|---|---|---|---|",
            *rows,
            "",
            "Said of all of them together:",
            "",
            *notes,
        ]
    )


def pool() -> str:
    """Return the section on the boat in the pool."""
    logs = [str(path) for path in sorted(DATA.glob(POOL))]
    began = time.monotonic()
    made = diagnose(logs, load_profile("vtec-usv"), DiagnosisSettings(), IN_MEMORY)
    seconds = time.monotonic() - began
    sure, hinted = _environment(made)
    return "\n".join(
        [
            "\n## VTec S-III in a pool\n",
            f"{len(logs)} bags of half a minute to a minute and a half, together, in {seconds:.0f} s. Nobody measured wind or "
            f"current. Of the environment named: {_listed(sure)}; as a hint: {_listed(hinted)}.",
            "",
            *[f"- {note.replace(f'{DATA}/', '')}" for note in made[0].notes if all(note in one.notes for one in made)],
        ]
    )


def _environment(made: Sequence[Diagnosis]) -> tuple[list[str], list[str]]:
    """Return effects of the environment, named and as hints, one for each log that has them."""
    found = [finding for one in made for finding in one.findings if finding.effect in ENVIRONMENT]
    sure, hinted = ([finding.effect for finding in found if finding.sure == way] for way in (True, False))
    return sure, hinted


def _listed(effects: Sequence[str]) -> str:
    return ", ".join(f"{name} ({effects.count(name)} logs)" for name in dict.fromkeys(effects)) or "none"
