"""What ``ferryid diagnose`` says of the recordings, and what speaks for and against it: reports/real/diagnosis.md."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from rosbags.highlevel import AnyReader

from ferryid.diagnose.data.estimate import Estimate
from ferryid.diagnose.data.measurements import read_measurements
from ferryid.diagnose.judging.diagnosis import Diagnosis
from ferryid.diagnose.judging.finding import Finding
from ferryid.diagnose.pipeline import DiagnosisSettings, diagnose
from ferryid.report import diagnosis_figures
from ferryid.report.diagnosis_words import numbers, probability, title
from ferryid.types import IN_MEMORY
from ferryid.vessel import load_profile
from tests.evidence import stamp
from tests.real import esso, pictures, witnesses
from tests.real.campaign import wind_table
from tests.real.places import DATA, FOLDER

KVLCC2 = "kvlcc2/*.dat"
GUNNERUS = "gunnerus/RVG_ManeuveringTests.csv"
VTEC = "vtec_usv/*.bag"
MILLIAMPERE = "milliampere1"
JUDGED_2025 = {
    "velocity_scale": (
        "Doubtful: at low frequencies north and east have different factors, which no scale of an instrument gives. "
        "A receiver that smooths its velocity, as the delay says, loses a few per cent of fast motion."
    ),
    "azimuth_offset": (
        "Doubtful: every thruster used one quadrant only, so that a turned thruster, a weaker one and a wrong thrust curve "
        "differ little; the encoder itself follows its order."
    ),
    "payload": (
        "Doubtful: the mass of this configuration is an assumption in the profile, and most of it again is no load."
    ),
    "time_delay": "Doubtful in open air: a controller that answers gusts looks the same.",
}
ENVIRONMENT = ("wind", "current", "gusts", "waves", "mooring", "shallow_water")
Judge = Callable[[Diagnosis, Finding], str]
"""What is to be said of a finding before those who ran the trial."""
UNJUDGED = "Not judged: no witness."


def agrees(estimate: Estimate, witness: float, within: float) -> str:
    """Return whether a witness lies in an estimate's interval, widened by what the witness itself may be wrong."""
    inside = estimate.low - within <= witness <= estimate.high + within
    word = "Defended" if inside else "Doubtful"
    return f"{word}: the witness says {witness:.2f} {estimate.unit}."


def write() -> None:
    """Diagnose every recording and write the page with its figures."""
    began = time.monotonic()
    parts = (osaka, milliampere, gunnerus, tank, pool)
    with ProcessPoolExecutor(2) as pool_:
        sections = [one.result() for one in [pool_.submit(part) for part in parts]]
    minutes = (time.monotonic() - began) / 60.0
    text = "\n".join([HEAD, *sections, f"\nMade in {minutes:.0f} minutes.\n"])
    put(text)
    stamp(FOLDER / "diagnosis.md")


def write_again(section: Callable[[], str]) -> None:
    """Make one section again; the others, and so the state of the page, stay as they are."""
    heading, _, body = section().strip().partition("\n")
    note = f"*Made again on {datetime.now(UTC):%Y-%m-%d}, by later sources than the rest of the page.*"
    path = FOLDER / "diagnosis.md"
    before, found, rest = path.read_text(encoding="utf-8").partition(heading + "\n")
    if not found:
        sys.exit(f"{path}: there is no section {heading!r}. Fix: make the whole page")
    after = rest[min(place for end in ("\n## ", "\nMade in ") if (place := rest.find(end)) >= 0) :]
    put(f"{before}{heading}\n\n{note}\n{body}\n{after}")


def put(text: str) -> None:
    """Write the page, and remove figures of its earlier findings that it no longer shows."""
    (FOLDER / "diagnosis.md").write_text(text, encoding="utf-8")
    # Not before all sections are made: a run that ends early leaves the page as it was, with its figures.
    for figure in FOLDER.glob("diagnosis-*.svg"):
        if f"({figure.name})" not in text:
            figure.unlink()


HEAD = """# Diagnoses of recordings of real vessels

Made by `make real`: what `ferryid diagnose` says of recordings that it knows nothing about, word for word, and beside it what
witnesses say that do not come out of the diagnosis: raw rows, correlations, the vessel's other sensors. Nobody has told us what
is truly wrong with these logs. What we would defend before the crew is called *defended*; what we would not, *doubtful*.
"""


def told(
    vessel: str, logs: Sequence[str], judge: Judge, *, each: bool = False, withhold: Sequence[str] = ()
) -> tuple[str, tuple[Diagnosis, ...]]:
    """Diagnose logs; return a table of findings with what is to be said of each, and write the figures of forces."""
    made = diagnose(
        logs,
        load_profile(vessel),
        DiagnosisSettings(each=each, withhold=tuple(withhold)),
        IN_MEMORY,
    )
    lines = ["| log | verdict | finding | probability | |", "|---|---|---|---|---|"]
    for one in made:
        rows = [(finding.says, probability(finding.probability), judge(one, finding)) for finding in one.findings] or [
            ("none", "", "")
        ]
        for k, (says, sure, word) in enumerate(rows):
            first = f"{one.log} | {one.verdict}" if k == 0 else " | "
            lines.append(f"| {first} | {says} | {sure} | {word} |")
    judged = [(finding, judge(one, finding)) for one in made for finding in one.findings]
    lines += ["", tally(judged), "", *_notes(made)]
    lines += _figures(vessel + "-together" * (len(logs) > 1 and not each), made)
    return "\n".join(lines), made


def tally(judged: Sequence[tuple[Finding, str]]) -> str:
    """Return how many findings above one half are defended, and which are not: the aim is all of them."""
    sure = [(finding, word) for finding, word in judged if finding.sure]
    if not sure:
        return "Findings above one half: none."
    defended, others = 0, dict[str, int]()
    for finding, word in sure:
        if "Defended" in word and "Doubtful" not in word:
            defended += 1
            continue
        kind = "doubtful" if "Doubtful" in word else "no witness"
        name = f"{title(finding.effect, finding.instance)}: {kind}"
        others[name] = others.get(name, 0) + 1
    listing = "; ".join(f"{name}{f' ({count} logs)' if count > 1 else ''}" for name, count in others.items())
    return (
        f"Findings above one half: {len(sure)}, of which {defended} are defended (aim: all, or not made)"
        f"{f'. The others: {listing}' if others else ''}."
    )


def _notes(made: Sequence[Diagnosis]) -> list[str]:
    """Return what was said beside the findings, each sentence once with the number of logs it was said of."""
    counts: dict[str, int] = {}
    for one in made:
        for note in one.notes:
            # The page has no folders of the machine that made it.
            said = note.replace(f"{DATA}/", "")
            counts[said] = counts.get(said, 0) + 1
    return [f"- {note}" + (f" ({count} logs)" if count > 1 else "") for note, count in counts.items()]


def _figures(name: str, made: Sequence[Diagnosis]) -> list[str]:
    """Write a figure of every finding on forces, of the first log that has it, and return the links."""
    links, seen = [], set()
    for one in made:
        for finding in one.findings:
            key = (finding.effect, finding.instance)
            if key in seen or not diagnosis_figures.compared(finding):
                continue
            seen.add(key)
            file = f"diagnosis-{name}-{finding.effect}{'-' + finding.instance if finding.instance else ''}.svg"
            (FOLDER / file).write_text(diagnosis_figures.on_regressor(finding), encoding="utf-8")
            links += [
                "",
                f"{one.log}: {finding.says} {numbers(finding)}",
                "",
                f"![{finding.effect} in {one.log}]({file})",
            ]
    return links


def osaka() -> str:
    """Return the section on the tanker model on the pond."""
    random, zigzag = (esso.study(kind, controlled=False) for kind in esso.KINDS)
    (FOLDER / "diagnosis-esso-osaka-winds.svg").write_text(pictures.winds((random, zigzag)), encoding="utf-8")
    profile = load_profile("esso-osaka")
    lags = [witnesses.velocity_lag(read_measurements(path, profile)[0]) for path in esso.logs("random")]
    (FOLDER / "diagnosis-esso-osaka-lag.svg").write_text(pictures.lag(lags, random.names), encoding="utf-8")
    seconds = [one.seconds for one in lags]
    by_log = dict(zip(random.names, seconds, strict=True))
    measured = dict(zip(random.names, random.measured, strict=True))
    paths = {Path(path).stem: path for path in esso.logs("random")}

    def judge(one: Diagnosis, finding: Finding) -> str:
        if finding.effect == "wind":
            parts = zip(("north", "east"), measured[one.log].tolist(), strict=True)
            return " ".join(agrees(finding.parameters[way], value, 0.0) for way, value in parts)
        if finding.effect == "gusts":
            gusty = witnesses.gustiness(read_measurements(paths[one.log], profile)[0])
            parts = (("std", gusty.std), ("time_constant", gusty.seconds))
            return " ".join(agrees(finding.parameters[name], value, 0.0) for name, value in parts)
        if finding.effect == "clock_offset":
            # Positive where positions are late; the witness is good to a row either way.
            return agrees(finding.parameters["seconds"], -by_log[one.log], 0.1)
        if finding.effect == "held_samples" and "north, east, heading" in finding.says:
            return "Defended: position and heading repeat together."
        if finding.effect == "held_samples" and finding.says.endswith("(heading)."):
            held_s = witnesses.repeated(pd.read_csv(paths[one.log]), "psi_hat [rad]")
            return f"Defended: the rows hold one heading for up to {held_s:.1f} s."
        if finding.effect in ("lever_arm", "payload", "thruster_gain"):
            return "Doubtful: what belongs to the vessel would show in all of its runs."
        return UNJUDGED

    text, made = told("esso-osaka", esso.logs("random"), judge, withhold=("wind",))
    named = sum(any(finding.effect == "wind" and finding.sure for finding in one.findings) for one in made)
    return "\n".join(
        [
            "\n## Esso Osaka on a pond, the wind withheld\n",
            "The runs measured the wind; it was hidden (`--withhold wind`), and the profile has no hull model. All runs of a "
            "kind are a campaign (`ferryid diagnose LOG... --vessel esso-osaka --withhold wind`): one hull, lift included, and "
            "a steady wind for each run, a random effect about a mean of all runs.",
            "",
            "![Bearing and strength](diagnosis-esso-osaka-winds.svg)",
            "",
            "**Random runs.**",
            "",
            *wind_table(random),
            "",
            "**Zigzags.**",
            "",
            *wind_table(zigzag),
            "",
            "The measured winds all go much the same way, so that runs agreeing with each other prove little. What held-out "
            "stretches and controls on other headings show is in [campaign.md](../campaign.md).",
            "",
            f"Of the random runs, diagnosed together, a wind is named in {named} of {len(made)}.",
            "",
            f"**Sensors.** By correlation of the slope of position and the velocity, velocities are {min(seconds):.1f} to "
            f"{max(seconds):.1f} s later than positions in all {len(seconds)} random runs: a filter in the receiver or after "
            "it. The delay was taken out before anything else.",
            "",
            "![Velocity against position](diagnosis-esso-osaka-lag.svg)",
            "",
            "**To record next:** ten minutes at rest and at slow speed on headings all round, for a steady "
            "wind; one run towed or "
            "self-propelled in still air, for the hull.",
            "",
            "What the tool says of the random runs, diagnosed together:",
            "",
            text,
        ]
    )


def milliampere() -> str:
    """Return the section on the ferry with four thrusters."""
    folder = DATA / MILLIAMPERE
    profile = load_profile("milliampere-2025")
    measurements = read_measurements(str(folder), profile)[0]
    lag, gain = witnesses.velocity_lag(measurements), witnesses.slow_gain(measurements)
    at, offsets, used = witnesses.antenna(folder), witnesses.encoder_offsets(folder), witnesses.sectors(measurements)
    sectors = "; ".join(
        f"{name} {low:.0f} to {high:.0f}" for name, (low, high) in zip(measurements.names, used, strict=True)
    )

    def judge(one: Diagnosis, finding: Finding) -> str:
        if finding.effect == "clock_offset":
            return agrees(finding.parameters["seconds"], -lag.seconds, 0.05)
        if finding.effect == "lever_arm":
            estimates = [finding.parameters[axis] for axis in ("x", "y")]
            return " ".join(agrees(one_, float(value), 0.25) for one_, value in zip(estimates, at, strict=True))
        return JUDGED_2025.get(finding.effect, UNJUDGED)

    (FOLDER / "diagnosis-milliampere-2025-lag.svg").write_text(pictures.lag([lag], ["one log"]), encoding="utf-8")
    table, made = told("milliampere-2025", [str(folder)], judge)
    named = any(finding.effect == "lever_arm" for one in made for finding in one.findings)
    missed = (
        ""
        if named
        else "**Missed:** the diagnosis does not find the antenna's offset, which an independent sensor shows.\n\n"
    )
    return "\n".join(
        [
            "\n## milliAmpère 2025\n",
            "Eight minutes of the ferry with four azimuth thrusters; its mass and its hull are not known. Witnesses:",
            "",
            f"- *Delay.* The receiver's velocity is {lag.seconds:.2f} s later than the slope of its position (correlation "
            f"{lag.correlation:.4f}).",
            f"- *Scale.* In slow motion (below 0.06 Hz) velocity over slope of position is {gain[0]:.3f} north "
            f"and {gain[1]:.3f} "
            "east.",
            f"- *Antenna.* Regressed on the heading, RTK positions lie {at[0]:.2f} m ahead and {at[1]:.2f} m to starboard of "
            "the positions of the ferry's own navigation, which the diagnosis does not read.",
            "- *Azimuth encoders* follow their orders: medians of measured less ordered angle "
            + ", ".join(f"{one:.2f}" for one in offsets)
            + " deg. That speaks for the encoders, not for how the thrusters were mounted.",
            f"- *Sectors.* Angles while pushing [deg]: {sectors}.",
            "",
            "![Velocity against position](diagnosis-milliampere-2025-lag.svg)",
            "",
            table,
            "",
            f"{missed}**To record next:** each thruster alone through all angles at two speeds, at rest; the mass, by "
            "acceleration with a "
            "known load; the place of the antenna, with a tape measure; wind.",
        ]
    )


def gunnerus() -> str:
    """Return the section on the research vessel."""
    path = DATA / GUNNERUS
    table = pd.read_csv(path)
    pace, long = witnesses.position_pace(table, 1), witnesses.position_pace(table, 120)
    straight = {name: witnesses.straight_share(table[name].to_numpy()) for name in ("u", "v", "r", "psi", "RPM")}
    some = slice(13520, 13620)
    rows = {
        "u [m/s]": table.u[some].to_numpy(),
        "v [m/s]": table.v[some].to_numpy(),
        "psi [deg]": table.psi[some].to_numpy(),
    }
    (FOLDER / "diagnosis-gunnerus-raw.svg").write_text(
        pictures.raw(table.tvec[some].to_numpy(), rows), encoding="utf-8"
    )
    shares = ", ".join(f"{name} {100.0 * share:.0f} %" for name, share in straight.items())
    factor, turn = witnesses.turned_by_course(table)

    def judge(one: Diagnosis, finding: Finding) -> str:
        if finding.effect == "yaw_rate_scale":
            # The drift at both ends of the circles may differ by some degrees.
            return agrees(finding.parameters["factor"], factor, 0.01)
        return UNJUDGED

    return "\n".join(
        [
            "\n## R/V Gunnerus\n",
            "Two and a half hours at 2 Hz, orders only, no hull model. Witnesses:",
            "",
            f"- *The table was interpolated.* Of the rows that change, so many lie on the straight line of their neighbours: "
            f"{shares}. No sensor does that: the ship's log had fewer and irregular readings, joined by lines. "
            f"Where two of them "
            "are equal a constant stretch is left, which is no held sample; the check was taught so on this log.",
            "- *Positions carry wrong times.* From row to row they run at "
            f"{pace[0]:.2f} to {pace[4]:.2f} times the logged speed (5 to 95 %; quartiles {pace[1]:.2f} and "
            f"{pace[3]:.2f}, median "
            f"{pace[2]:.2f}), over a minute at {long[0]:.2f} to {long[4]:.2f} times.",
            f"- *The yaw rate turns too far.* In whole circles it adds up to {factor:.3f} times the turn of the course, which "
            f"positions alone give, over {turn:.0f} deg.",
            "",
            "![Raw rows](diagnosis-gunnerus-raw.svg)",
            "",
            told("gunnerus", [str(path)], judge)[0],
            "",
            "**To record next:** the same manoeuvres with the time stamps of the sensors, feedback of azimuth "
            "and rpm instead of "
            "orders, and the wind.",
        ]
    )


def tank() -> str:
    """Return the section on the towing tank."""
    logs = [str(path) for path in sorted(DATA.glob(KVLCC2))]

    def judge(one: Diagnosis, finding: Finding) -> str:
        if finding.effect in ENVIRONMENT:
            return "**Wrong**: there is none in a towing tank."
        if finding.effect == "lever_arm":
            return "Doubtful: nothing says where the carriage measured, but what the hull's model lacks looks the same."
        return UNJUDGED

    alone = told("kvlcc2-model", logs, judge, each=True)
    one_hull, shared = told("kvlcc2-model", logs, judge)
    environment = sum(finding.effect in ENVIRONMENT for one in shared for finding in one.findings)
    arms = [
        sum(any(finding.effect == "lever_arm" for finding in one.findings) for one in made)
        for made in (alone[1], shared)
    ]
    environment += sum(finding.effect in ENVIRONMENT for one in alone[1] for finding in one.findings)
    return "\n".join(
        [
            "\n## KVLCC2 in a towing tank\n",
            "No wind, waves or current: whatever of these is named here is false. A zigzag between two headings "
            "leaves lift, drag "
            "and a current much alike, which is what makes it a trap.",
            "",
            f"Of wind, current, gusts, waves, moorings and shallow water {environment} are named in {len(logs)} logs, each "
            f"diagnosed by itself and all together as a campaign. By itself {arms[0]} show an antenna off the origin, "
            f"together {arms[1]}.",
            "",
            "Each by itself (`--each`):",
            "",
            alone[0],
            "",
            "All together:",
            "",
            one_hull,
        ]
    )


def pool() -> str:
    """Return the section on the boat in the pool."""
    logs = [str(path) for path in sorted(DATA.glob(VTEC))]
    profile = load_profile("vtec-usv")
    lines = [
        "\n## VTec S-III in a pool\n",
        "Ten bags of half a minute to a minute and a half: too short for a verdict on forces. What raw rows show:",
        "",
        "| bag | longest time without any order [s] | surge velocity then: slowest, fastest after [m/s] |",
        "|---|---|---|",
    ]
    steps, shown = [], None
    for log in logs:
        measurements = read_measurements(log, profile)[0]
        steps.append(witnesses.position_steps(_poses(log)))
        told_ = witnesses.idle(measurements)
        if told_ is not None:
            lines.append(f"| {Path(log).stem} | {told_[0]:.0f} | {told_[1]:.2f}, {told_[2]:.2f} |")
            if shown is None or told_[2] - told_[1] > shown[0]:
                shown = (told_[2] - told_[1], log, measurements)
    if shown is not None:
        (FOLDER / "diagnosis-vtec-usv-driven.svg").write_text(pictures.driven(shown[2]), encoding="utf-8")
        lines += [
            "",
            f"In {Path(shown[1]).stem} the boat gains {shown[0]:.1f} m/s and keeps going while both orders are zero: "
            "most likely somebody drove it back by remote control. Whoever fits a hull to such a stretch fits a "
            "boat that moves by itself. This log is why "
            "the tool has a check for it.",
            "",
            f"![{Path(shown[1]).stem}](diagnosis-vtec-usv-driven.svg)",
        ]
    common = steps[0]

    def judge(one: Diagnosis, finding: Finding) -> str:
        return "Defended: see the figure." if finding.effect == "unrecorded_force" else UNJUDGED

    lines += [
        "",
        "Positions move on a grid: the commonest steps are "
        + ", ".join(f"{length:.2f} m ({100.0 * share:.0f} %)" for length, share in common)
        + ". Such are longitude and latitude in single precision; a slow boat repeats its position on it without any sample "
        "being old.",
        "",
        told("vtec-usv", logs, judge, each=True)[0],
        "",
        "**To record next:** one bag of ten minutes instead of ten bags, positions in double precision, and the "
        "orders of the "
        "remote control.",
    ]
    return "\n".join(lines)


def _poses(log: str) -> esso.Floats:
    with AnyReader([Path(log)]) as bag:
        chosen = [one for one in bag.connections if one.topic == "/NED_pose"]
        read: Iterator[Any] = (bag.deserialize(raw, one.msgtype) for one, _, raw in bag.messages(chosen))
        return np.array([(message.x, message.y) for message in read])
