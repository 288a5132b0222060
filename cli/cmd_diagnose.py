"""ferryid diagnose."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from ferryid.cli.completion import model_names
from ferryid.cli.options import OUT, From, Json, Logs, Out, To, Verify, Vessel, ranges
from ferryid.cli.output import emit, progress, tell
from ferryid.cli.several import several_after

Command = several_after("--versus", "--reference")


def command(
    logs: Logs,
    vessel: Vessel = None,
    from_: From = None,
    to: To = None,
    model: Annotated[
        str | None,
        typer.Option(
            autocompletion=model_names,
            help="Model to examine: path, name or name@version; the profile's hull if left out.",
        ),
    ] = None,
    against: Annotated[
        str | None,
        typer.Option(help="A simulated log of the same trial to compare the recording with, instead of a model."),
    ] = None,
    each: Annotated[
        bool, typer.Option("--each", help="Diagnose every log by itself; else several logs are one campaign.")
    ] = False,
    together: Annotated[bool, typer.Option("--together", hidden=True)] = False,
    versus: Annotated[
        list[str] | None,
        typer.Option(
            help="Logs to compare the others with, one or several: in which properties and loads they differ."
        ),
    ] = None,
    reference: Annotated[
        list[str] | None,
        typer.Option(help="Other recordings of the vessel, one or several, that bring its hull and get no diagnosis."),
    ] = None,
    withhold: Annotated[
        list[str] | None, typer.Option(help="A signal to hide, such as wind, and to compare afterwards; repeatable.")
    ] = None,
    setting: Annotated[
        str, typer.Option(help="Where the logs were recorded: tank, pond, harbour or sea; the profile's if left out.")
    ] = "",
    name: Annotated[
        str, typer.Option(help="Name of the model with the findings; the examined model's or the vessel's if left out.")
    ] = "",
    verify: Verify = False,
    out: Out = OUT,
    json: Json = None,
) -> None:
    """Say which physics a model left out of recordings, and what shows it.

    Several logs of one vessel are a campaign: one hull is estimated from all of them, and conditions such as a wind are
    confirmed over all. With --versus, the logs before and after it are two groups with one hull, and the differences between
    the groups are the result.
    """
    from ferryid import api
    from ferryid.diagnose import DiagnosisSettings

    settings = DiagnosisSettings(
        None, against, each and not together, tuple(withhold or ()), tuple(reference or ()), setting
    )
    used = ranges(from_, to)
    words = ("ferryid", *sys.argv[1:])
    if versus:
        outcome = api.compare_groups(
            logs, versus, vessel or None, out, model=model, settings=settings, name=name, command=words, verify=verify,
            ranges=used, progress=progress, announce=tell,
        )  # fmt: skip
        emit(outcome, json)
        return
    outcome = api.diagnose(
        logs,
        vessel or None,
        out,
        model=model,
        settings=settings,
        name=name,
        command=words,
        verify=verify,
        ranges=used,
        progress=progress,
        announce=tell,
    )
    emit(outcome, json)
