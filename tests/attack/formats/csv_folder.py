"""Folders of CSV files, one topic each."""

from __future__ import annotations

import csv
import io
from random import Random

from tests.attack.case import Base, Mutated, Mutation
from tests.attack.formats import text_table
from tests.attack.logs import messages, rows

WANTED = {"/position": ("point.x",), "/speed": ("data",)}


def bases() -> list[Base]:
    """As exports of ROS 2 bags have them."""
    texts = {topic: io.StringIO() for topic in WANTED}
    writers = {topic: csv.writer(text, lineterminator="\n") for topic, text in texts.items()}
    for topic, (field,) in WANTED.items():
        writers[topic].writerow(["time", field])
    for topic, time, value in messages():
        writers[topic].writerow([str(time), repr(value)])
    files = {f"log{topic}.csv": text.getvalue().encode() for topic, text in texts.items()}
    truth = rows(
        (topic, int(row["time"]), float(row[field]))
        for topic, (field,) in WANTED.items()
        for row in csv.DictReader(io.StringIO(files[f"log{topic}.csv"].decode()))
    )
    return [Base("csv_folder", "two topics", files, "log", truth, WANTED)]


def files_changed(random: Random, base: Base) -> Mutated | None:
    """Lose, empty or double a file, or put another beside it."""
    name = random.choice(sorted(base.files))
    files = dict(base.files)
    rows_of = {f"log{topic}.csv": len(each.times) for topic, each in base.truth.items()}
    total = base.count
    action = random.choice(("lost", "empty", "doubled", "noise", "hidden", "deep"))
    if action == "lost":
        del files[name]
        total -= rows_of[name]
    elif action == "empty":
        files[name] = b""
        total -= rows_of[name]
    elif action == "doubled":
        files["log/other.csv"] = files[name]
        total += rows_of[name]
    elif action == "noise":
        files["log/other.csv"] = random.randbytes(300)
    elif action == "hidden":
        files["log/.other.csv"] = files[name]
    else:
        files["log/" + "d/" * 60 + "other.csv"] = files[name]
        total += rows_of[name]
    return Mutated(f"{name} {action}", files, total=total)


MUTATIONS: dict[str, Mutation] = {**text_table.MUTATIONS, "files of the folder": files_changed}
