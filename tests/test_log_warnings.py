"""What is said of single logs of several: one line where it differs by its numbers alone."""

from __future__ import annotations

from ferryid.log_warnings import left_out_together, log_warnings


def used(seconds: str, first: str, topic: str = "/left_thruster2") -> str:
    return f"{seconds} s are used, without the first {first} s, as {topic} begins then."


def test_what_several_logs_have_alike_is_one_warning_with_ranges() -> None:
    told = [("a", [used("83.0", "5.9")]), ("b", [used("1,030.0", "10.8"), "It is still."]), ("c", [used("9.5", "5.9")])]
    assert log_warnings(told) == (
        "3 logs: 9.5 to 1,030.0 s are used, without the first 5.9 to 10.8 s, as /left_thruster2 begins then.",
        "b: It is still.",
    )


def test_what_two_logs_have_or_what_differs_by_a_name_or_a_time_stays_of_each() -> None:
    two = [("a", [used("83.0", "5.9")]), ("b", [used("9.5", "3.7")])]
    assert log_warnings(two) == tuple(f"{name}: {one}" for name, (one,) in two)
    named = [(name, [used("83.0", "5.9", f"/thruster{name}")]) for name in "123"]
    assert log_warnings(named) == tuple(f"{name}: {one}" for name, (one,) in named)
    timed = [(name, [f"It begins at 10:4{name}:10."]) for name in "123"]
    assert log_warnings(timed) == tuple(f"{name}: {one}" for name, (one,) in timed)


def test_intervals_of_several_logs_become_the_one_that_holds_them_all() -> None:
    def told(*said: str) -> str:
        (one,) = log_warnings([(str(i), [sentence]) for i, sentence in enumerate(said)])
        return one

    slopes = [
        f"The slope is {one} times it, 99 % interval {low} to {high}, of 7 to 8."
        for one, low, high in (("3.48", "2.00", "5.01"), ("2.85", "1.65", "4.00"), ("3.00", "2.49", "7.11"))
    ]
    assert told(*slopes) == "3 logs: The slope is 2.85 to 3.48 times it, 99 % interval 1.65 to 7.11, of 7 to 8."
    assert told("A (1 to 2).", "A (0 to 5).", "A (1 to 3).") == "3 logs: A (0 to 5)."
    # A change is no interval.
    assert told("It went from 9 to 4.", "It went from 8 to 5.", "It went from 1 to 6.") == (
        "3 logs: It went from (1 to 9) to (4 to 6)."
    )
    assert told("Bytes 5 to 9.", "Bytes 5 to 8.", "Bytes 5 to 7.") == "3 logs: Bytes 5 to (7 to 9)."


def test_logs_left_out_for_one_reason_are_told_together() -> None:
    why = "position is needed by the profile, found no topic. Fix: map it"
    left = [f"Left out of the fit: logs/{name}.bag: {why}" for name in "abcde"]
    short = [
        f"Left out of the fit: {name}: too short, found {found} s. Fix: more" for name, found in (("f", 2), ("g", 3))
    ]
    told = ["Heed this.", left[0], short[0], *left[1:], short[1]]
    assert left_out_together(told) == [
        "Heed this.",
        f"Left out of the fit: 5 logs (logs/a.bag, logs/b.bag, logs/c.bag and 2 more): {why}",
        *short,
    ]
    third = "Left out of the fit: h: too short, found 1 s. Fix: more"
    assert left_out_together([*short, third]) == [
        "Left out of the fit: 3 logs (f, g, h): too short, found 1 to 3 s. Fix: more"
    ]
    # Of a campaign and of its references each by itself.
    other = [one.replace("fit", "references") for one in left[:2]]
    assert left_out_together([*left[:2], *other]) == [*left[:2], *other]
