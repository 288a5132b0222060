"""FMI 3: a source-code FMU for model exchange and co-simulation around the C header; FMI 3.0 standard, Modelica Association.

The archive is stored uncompressed and without times, so that the same model gives the same bytes and its head stays readable.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator

from ferryid import __version__
from ferryid.export.exported import Exported
from ferryid.export.fmi3_source import PLACE, STATES, VARIABLES, source, token
from ferryid.export.format import Format
from ferryid.export.formats import c
from ferryid.export.names import plain
from ferryid.export.sdf import comment
from ferryid.export.words import beside, frames, heading, limits

_EARLIEST = (1980, 1, 1, 0, 0, 0)
"""The earliest time that an archive can hold."""

_UNITS = {
    "m": 'm="1"',
    "m/s": 'm="1" s="-1"',
    "m/s2": 'm="1" s="-2"',
    "rad": 'rad="1"',
    "rad/s": 'rad="1" s="-1"',
    "rad/s2": 'rad="1" s="-2"',
    "N": 'kg="1" m="1" s="-2"',
    "N.m": 'kg="1" m="2" s="-2"',
    "kg": 'kg="1"',
}


def render(one: Exported) -> bytes:
    """Return the archive."""
    files = {
        "modelDescription.xml": _description(one),
        "sources/buildDescription.xml": _build(one),
        f"sources/{one.name}.h": str(c.render(one)),
        "sources/fmu.c": source(one),
    }
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as made:
        for name, text in files.items():
            entry = zipfile.ZipInfo(name, _EARLIEST)
            # The same on every system.
            entry.create_system = 3
            entry.external_attr = 0o644 << 16
            made.writestr(entry, text)
    return archive.getvalue()


def _build(one: Exported) -> str:
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
        f'  <BuildConfiguration modelIdentifier="{one.name}">\n    <SourceFileSet language="C99">\n'
        '      <SourceFile name="fmu.c"/>\n    </SourceFileSet>\n  </BuildConfiguration>\n</fmiBuildDescription>\n'
    )


def _description(one: Exported) -> str:
    head = [*heading(one), "", *frames(one), "", *limits(one), *beside(one)]
    abilities = f'modelIdentifier="{one.name}" canGetAndSetFMUState="true"'
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        comment(head),
        f'<fmiModelDescription fmiVersion="3.0" modelName="{one.name}" instantiationToken="{token(one)}"'
        f' description="{_text(one.model.label)}" generationTool="ferryid {__version__}" variableNamingConvention="flat">',
        f"  <ModelExchange {abilities}/>",
        f'  <CoSimulation {abilities} canHandleVariableCommunicationStepSize="true"/>',
        "  <UnitDefinitions>",
        *(f'    <Unit name="{name}"><BaseUnit {base}/></Unit>' for name, base in _UNITS.items()),
        "  </UnitDefinitions>",
        "  <ModelVariables>",
        *(f"    {line}" for line in _variables()),
        "  </ModelVariables>",
        "  <ModelStructure>",
        *(f"    {line}" for line in _structure()),
        "  </ModelStructure>",
        "</fmiModelDescription>",
        "",
    ]
    return "\n".join(lines)


def _variables() -> Iterator[str]:
    for place, one in enumerate(VARIABLES):
        head = f'<Float64 name="{one.name}" valueReference="{place}" description="{_text(one.says)}"'
        unit = f' unit="{one.unit}"' if one.unit else ""
        if one.causality == "independent":
            yield f'{head} causality="independent" variability="continuous"/>'
        elif one.causality == "calculatedParameter":
            yield f'{head} causality="calculatedParameter" variability="fixed" initial="calculated"/>'
        elif one.causality == "parameter":
            yield f'{head} causality="parameter" variability="fixed" start="{one.start}"/>'
        elif one.causality == "local":
            state = PLACE[one.name.removeprefix("der_")]
            yield f'{head}{unit} causality="local" initial="calculated" derivative="{state}"/>'
        else:
            exact = ' initial="exact"' if one.causality == "output" else ""
            yield f'{head}{unit} causality="{one.causality}"{exact} start="{one.start}"/>'


def _structure() -> Iterator[str]:
    for name, *_ in STATES:
        yield f'<Output valueReference="{PLACE[name]}"/>'
    for kind in ("ContinuousStateDerivative", "InitialUnknown"):
        for name, *_ in STATES:
            yield f'<{kind} valueReference="{PLACE[f"der_{name}"]}"/>'
    yield f'<InitialUnknown valueReference="{PLACE["wrong_values"]}"/>'


def _text(text: str) -> str:
    spelt = plain(text)
    for sign, entity in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ('"', "&quot;")):
        spelt = spelt.replace(sign, entity)
    return spelt


FORMAT = Format(
    "fmi3",
    ".fmu",
    "an FMU of FMI 3.0 with C sources, for model exchange and co-simulation",
    render,
    "compile and check it with: fmpy compile {file} && fmpy validate {file}; its wrong_values is 0",
)
