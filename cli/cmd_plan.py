"""ferryid plan."""

from __future__ import annotations

from typing import Annotated

import typer

from ferryid.cli.completion import effect_names, model_names
from ferryid.cli.options import OUT, From, Json, Out, To, Verify, Vessel, ranges
from ferryid.cli.output import emit, progress, tell
from ferryid.cli.several import several_after
from ferryid.errors import FerryIdError

Command = several_after("--after")


def command(
    vessel: Vessel = None,
    after: Annotated[
        list[str] | None,
        typer.Option(help="Recordings of the vessel, one or several: what they show already counts."),
    ] = None,
    from_: From = None,
    to: To = None,
    model: Annotated[
        str | None,
        typer.Option(
            autocompletion=model_names, help="Diagnosed model that brings the hull: path, name or name@version."
        ),
    ] = None,
    minutes: Annotated[float, typer.Option(help="Longest time of the trial [min].")] = 12.0,
    area: Annotated[
        str,
        typer.Option(help="Length x breadth of the water [m], as 60x40; 12 by 8 lengths of the vessel if left out."),
    ] = "",
    separate: Annotated[
        list[str] | None,
        typer.Option(
            autocompletion=effect_names,
            help="Two effects to separate, as wind,current; repeatable. Those that --after leaves alike are too.",
        ),
    ] = None,
    origin: Annotated[
        str, typer.Option(help="LATITUDE,LONGITUDE of the middle of the area [deg], for a mission of QGroundControl.")
    ] = "",
    bearing: Annotated[float, typer.Option(help="Of the area's longer side, clockwise from north [deg].")] = 0.0,
    seed: Annotated[int, typer.Option(help="Seed of the simulated noise.")] = 1,
    name: Annotated[str, typer.Option(help="Name of the plan, its folder in plans/; the vessel's if left out.")] = "",
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier plan of that name.")] = False,
    verify: Verify = False,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Design the trial that would show most about a vessel, as waypoints and as a scenario.

    Manoeuvres are simulated in calm water with the vessel's own sensors, and chosen by how far they bring down the standard
    deviations of the hull's coefficients, and how well they separate effects that look alike.
    """
    from ferryid import api

    outcome = api.plan(
        vessel or None,
        after or (),
        out,
        model=model,
        minutes=minutes,
        area=_two(area, "x", "--area", "60x40") if area else None,
        separate=[_pair(one) for one in separate or ()],
        origin=_two(origin, ",", "--origin", "63.43,10.39") if origin else None,
        bearing_deg=bearing,
        seed=seed,
        name=name,
        overwrite=overwrite,
        verify=verify,
        ranges=ranges(from_, to),
        progress=progress,
        announce=tell,
    )
    emit(outcome, json)


def _two(text: str, between: str, option: str, example: str) -> tuple[float, float]:
    """Return the two numbers of an option."""
    try:
        first, second = (float(one) for one in text.lower().split(between))
    except ValueError:
        raise FerryIdError(f"{option}: is two numbers, found {text!r}. Fix: give them as {example}") from None
    return first, second


def _pair(text: str) -> tuple[str, str]:
    names = [one.strip() for one in text.split(",")]
    if len(names) != 2 or names[0] == names[1]:
        raise FerryIdError(f"--separate: is two different effects, found {text!r}. Fix: give them as wind,current")
    return names[0], names[1]
