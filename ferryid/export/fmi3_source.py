"""C code of an FMU: the functions of FMI 3.0 around the exported header, and the variables that they know by number."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from ferryid import __version__
from ferryid.export.exported import Exported

LONGEST_STEP_S = 0.02
"""Of the Runge-Kutta method within a step of co-simulation [s]."""


@dataclass(frozen=True)
class Variable:
    """One variable: name, causality, unit and what it is; its reference is its place in the list."""

    name: str
    causality: str
    unit: str
    says: str
    start: float = 0.0


STATES = (
    ("u", "m/s", "m/s2", "surge over ground, ahead"),
    ("v", "m/s", "m/s2", "sway over ground, to starboard"),
    ("r", "rad/s", "rad/s2", "yaw rate, to starboard"),
    ("x", "m", "m/s", "position north"),
    ("y", "m", "m/s", "position east"),
    ("psi", "rad", "rad/s", "heading, clockwise from north"),
)
VARIABLES = (
    Variable("time", "independent", "", "time [s]"),
    Variable("X", "input", "N", "applied force ahead"),
    Variable("Y", "input", "N", "applied force to starboard"),
    Variable("N", "input", "N.m", "applied moment to starboard"),
    Variable("wind_N", "input", "m/s", "where the air goes to over ground, north"),
    Variable("wind_E", "input", "m/s", "where the air goes to over ground, east"),
    Variable("current_N", "input", "m/s", "where the water goes to over ground, north"),
    Variable("current_E", "input", "m/s", "where the water goes to over ground, east"),
    Variable("payload_m", "input", "kg", "mass aboard beside the vessel itself"),
    Variable("payload_x", "input", "m", "place of that mass ahead of the body origin"),
    *(Variable(name, "output", unit, says) for name, unit, _, says in STATES),
    *(Variable(f"der_{name}", "local", unit, f"rate of {name}") for name, _, unit, _ in STATES),
    Variable(
        "air", "parameter", "", "1 where the air acts, 0 where there is no load of it, not even of still air", 1.0
    ),
    Variable(
        "wrong_values",
        "calculatedParameter",
        "",
        "self-test: values that differ from those of ferryid, 0 where all is well",
    ),
)
PLACE = {one.name: k for k, one in enumerate(VARIABLES)}
_PLACES = ("X", "wind_N", "current_N", "payload_m", "u", "der_u", "air", "wrong_values")
"""Variables whose places the C code needs."""

_TYPES = (
    *((f"{sign}Int{bits}", f"{kind}int{bits}_t") for bits in (8, 16, 32, 64) for sign, kind in (("", ""), ("U", "u"))),
    ("Float32", "float"),
    ("Boolean", "bool"),
    ("String", "const char *"),
)
_MODES = (
    *("ExitInitializationMode", "EnterEventMode", "EnterContinuousTimeMode", "EnterStepMode"),
    *("EvaluateDiscreteStates", "Terminate"),
)
_REFERENCES = "const uint32_t *refs, size_t n"
_DERIVATIVE = (
    "const uint32_t *unknowns, size_t n, const uint32_t *knowns, size_t k, const double *seed, size_t s, "
    "double *out, size_t m"
)
_UNSUPPORTED = {
    "GetBinary": f"{_REFERENCES}, size_t *sizes, const uint8_t **values, size_t m",
    "SetBinary": f"{_REFERENCES}, const size_t *sizes, const uint8_t *const *values, size_t m",
    "GetClock": f"{_REFERENCES}, bool *values",
    "SetClock": f"{_REFERENCES}, const bool *values",
    "GetNumberOfVariableDependencies": "uint32_t ref, size_t *n",
    "GetVariableDependencies": "uint32_t ref, size_t *e, uint32_t *refs, size_t *f, int *kinds, size_t n",
    "SerializedFMUStateSize": "void *state, size_t *size",
    "SerializeFMUState": "void *state, uint8_t *bytes, size_t size",
    "DeserializeFMUState": "const uint8_t *bytes, size_t size, void **state",
    "GetDirectionalDerivative": _DERIVATIVE,
    "GetAdjointDerivative": _DERIVATIVE,
    "EnterConfigurationMode": "",
    "ExitConfigurationMode": "",
    "GetIntervalDecimal": f"{_REFERENCES}, double *intervals, int *qualifiers",
    "GetIntervalFraction": f"{_REFERENCES}, uint64_t *counters, uint64_t *resolutions, int *qualifiers",
    "GetShiftDecimal": f"{_REFERENCES}, double *shifts",
    "GetShiftFraction": f"{_REFERENCES}, uint64_t *counters, uint64_t *resolutions",
    "SetIntervalDecimal": f"{_REFERENCES}, const double *intervals",
    "SetIntervalFraction": f"{_REFERENCES}, const uint64_t *counters, const uint64_t *resolutions",
    "SetShiftDecimal": f"{_REFERENCES}, const double *shifts",
    "SetShiftFraction": f"{_REFERENCES}, const uint64_t *counters, const uint64_t *resolutions",
    "GetOutputDerivatives": f"{_REFERENCES}, const int32_t *orders, double *values, size_t m",
    "ActivateModelPartition": "uint32_t clock, double time",
}

_SOURCE = """
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "{name}.h"

/* The interface of FMI 3.0, as far as it is used. */
typedef enum {{ fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal }} fmi3Status;

#ifndef FMI3_Export
#if defined _WIN32 || defined __CYGWIN__
#define FMI3_Export __declspec(dllexport)
#elif defined __GNUC__
#define FMI3_Export __attribute__((visibility("default")))
#else
#define FMI3_Export
#endif
#endif
#ifdef FMI3_FUNCTION_PREFIX
#define FMI3_PASTE(a, b) a##b
#define FMI3_JOIN(a, b) FMI3_PASTE(a, b)
#define FMI3(name) FMI3_JOIN(FMI3_FUNCTION_PREFIX, fmi3##name)
#else
#define FMI3(name) fmi3##name
#endif
#define FUNCTION(name) FMI3_Export fmi3Status FMI3(name)

static const char *const token = "{token}";

enum {{ X = {X}, WIND = {wind_N}, CURRENT = {current_N}, PAYLOAD = {payload_m} }};
enum {{ STATE = {u}, RATE = {der_u}, AIR = {air}, WRONG = {wrong_values} }};
enum {{ STATES = 6, VALUES = {count} }};

typedef struct {{
    double value[VALUES];
}} Vessel;

static void start(Vessel *vessel)
{{
    memset(vessel, 0, sizeof *vessel);
    vessel->value[AIR] = 1.0;
    vessel->value[WRONG] = {name}_self_test();
}}

static void rates(const double *value, const double *state, double *rate)
{{
    const double psi = state[5], cosine = cos(psi), sine = sin(psi);
    const double *wind = {wind};
    {name}_acceleration(value + X, state, psi, wind, value + CURRENT, value + PAYLOAD, rate);
    rate[3] = cosine * state[0] - sine * state[1];
    rate[4] = sine * state[0] + cosine * state[1];
    rate[5] = state[2];
}}

/* One step of the classical Runge-Kutta method, with the inputs held. */
static void advance(Vessel *vessel, double h)
{{
    static const double part[4] = {{0.0, 0.5, 0.5, 1.0}}, weight[4] = {{1.0, 2.0, 2.0, 1.0}};
    double rate[STATES] = {{0.0}}, state[STATES], sum[STATES] = {{0.0}};
    for (int stage = 0; stage < 4; ++stage) {{
        for (int i = 0; i < STATES; ++i) state[i] = vessel->value[STATE + i] + part[stage] * h * rate[i];
        rates(vessel->value, state, rate);
        for (int i = 0; i < STATES; ++i) sum[i] += weight[stage] * rate[i];
    }}
    for (int i = 0; i < STATES; ++i) vessel->value[STATE + i] += h * sum[i] / 6.0;
}}

static void *made(const char *given)
{{
    Vessel *vessel = NULL;
    if (given && strcmp(given, token) == 0) vessel = malloc(sizeof *vessel);
    if (vessel) start(vessel);
    return vessel;
}}

FMI3_Export const char *FMI3(GetVersion)(void) {{ return "3.0"; }}

FUNCTION(SetDebugLogging)(void *instance, bool on, size_t n, const char *const *categories)
{{
    (void)instance; (void)on; (void)n; (void)categories;
    return fmi3OK;
}}

FMI3_Export void *FMI3(InstantiateModelExchange)(const char *name, const char *given, const char *resources, bool visible,
    bool logging, void *environment, void *log)
{{
    (void)name; (void)resources; (void)visible; (void)logging; (void)environment; (void)log;
    return made(given);
}}

FMI3_Export void *FMI3(InstantiateCoSimulation)(const char *name, const char *given, const char *resources, bool visible,
    bool logging, bool events, bool early, const uint32_t *intermediate, size_t n, void *environment, void *log, void *update)
{{
    (void)name; (void)resources; (void)visible; (void)logging; (void)events; (void)early; (void)intermediate; (void)n;
    (void)environment; (void)log; (void)update;
    return made(given);
}}

FMI3_Export void *FMI3(InstantiateScheduledExecution)(const char *name, const char *given, const char *resources,
    bool visible, bool logging, void *environment, void *log, void *clock, void *lock, void *unlock)
{{
    (void)name; (void)given; (void)resources; (void)visible; (void)logging; (void)environment; (void)log; (void)clock;
    (void)lock; (void)unlock;
    return NULL;
}}

FMI3_Export void FMI3(FreeInstance)(void *instance) {{ free(instance); }}

FUNCTION(EnterInitializationMode)(void *instance, bool tolerant, double tolerance, double time, bool ends, double end)
{{
    (void)tolerant; (void)tolerance; (void)ends; (void)end;
    ((Vessel *)instance)->value[0] = time;
    return fmi3OK;
}}

FUNCTION(Reset)(void *instance)
{{
    start(instance);
    return fmi3OK;
}}

{modes}

FUNCTION(GetFloat64)(void *instance, const uint32_t *refs, size_t n, double *values, size_t m)
{{
    Vessel *vessel = instance;
    if (n != m) return fmi3Error;
    rates(vessel->value, vessel->value + STATE, vessel->value + RATE);
    for (size_t i = 0; i < n; ++i) {{
        if (refs[i] >= VALUES) return fmi3Error;
        values[i] = vessel->value[refs[i]];
    }}
    return fmi3OK;
}}

FUNCTION(SetFloat64)(void *instance, const uint32_t *refs, size_t n, const double *values, size_t m)
{{
    if (n != m) return fmi3Error;
    for (size_t i = 0; i < n; ++i) {{
        const bool free_to_set = (refs[i] >= X && refs[i] < RATE) || refs[i] == AIR;
        if (!free_to_set) return fmi3Error;
        ((Vessel *)instance)->value[refs[i]] = values[i];
    }}
    return fmi3OK;
}}

FUNCTION(GetFMUState)(void *instance, void **state)
{{
    if (!*state) *state = malloc(sizeof(Vessel));
    if (!*state) return fmi3Error;
    memcpy(*state, instance, sizeof(Vessel));
    return fmi3OK;
}}

FUNCTION(SetFMUState)(void *instance, void *state)
{{
    memcpy(instance, state, sizeof(Vessel));
    return fmi3OK;
}}

FUNCTION(FreeFMUState)(void *instance, void **state)
{{
    (void)instance;
    free(*state);
    *state = NULL;
    return fmi3OK;
}}

FUNCTION(UpdateDiscreteStates)(void *instance, bool *again, bool *ends, bool *nominals, bool *values, bool *timed, double *next)
{{
    (void)instance; (void)next;
    *again = *ends = *nominals = *values = *timed = false;
    return fmi3OK;
}}

FUNCTION(CompletedIntegratorStep)(void *instance, bool final, bool *event, bool *ends)
{{
    (void)instance; (void)final;
    *event = *ends = false;
    return fmi3OK;
}}

FUNCTION(SetTime)(void *instance, double time)
{{
    ((Vessel *)instance)->value[0] = time;
    return fmi3OK;
}}

FUNCTION(SetContinuousStates)(void *instance, const double *states, size_t n)
{{
    if (n != STATES) return fmi3Error;
    memcpy(((Vessel *)instance)->value + STATE, states, sizeof(double) * STATES);
    return fmi3OK;
}}

FUNCTION(GetContinuousStates)(void *instance, double *states, size_t n)
{{
    if (n != STATES) return fmi3Error;
    memcpy(states, ((Vessel *)instance)->value + STATE, sizeof(double) * STATES);
    return fmi3OK;
}}

FUNCTION(GetContinuousStateDerivatives)(void *instance, double *out, size_t n)
{{
    if (n != STATES) return fmi3Error;
    rates(((Vessel *)instance)->value, ((Vessel *)instance)->value + STATE, out);
    return fmi3OK;
}}

FUNCTION(GetNominalsOfContinuousStates)(void *instance, double *nominals, size_t n)
{{
    (void)instance;
    for (size_t i = 0; i < n; ++i) nominals[i] = 1.0;
    return fmi3OK;
}}

FUNCTION(GetEventIndicators)(void *instance, double *indicators, size_t n)
{{
    (void)instance; (void)indicators;
    return n ? fmi3Error : fmi3OK;
}}

FUNCTION(GetNumberOfEventIndicators)(void *instance, size_t *n)
{{
    (void)instance;
    *n = 0;
    return fmi3OK;
}}

FUNCTION(GetNumberOfContinuousStates)(void *instance, size_t *n)
{{
    (void)instance;
    *n = STATES;
    return fmi3OK;
}}

FUNCTION(DoStep)(void *instance, double time, double step, bool kept, bool *event, bool *ends, bool *early, double *last)
{{
    const int parts = step > 0.0 ? (int)ceil(step / {longest} - 1e-9) : 0;
    (void)kept;
    for (int i = 0; i < parts; ++i) advance(instance, step / parts);
    ((Vessel *)instance)->value[0] = *last = time + step;
    *event = *ends = *early = false;
    return fmi3OK;
}}

/* What this model has none of. */
{unsupported}
"""


def source(one: Exported) -> str:
    """Return the C code of the interface."""
    return _SOURCE.format(
        name=one.name,
        token=token(one),
        count=len(VARIABLES),
        longest=LONGEST_STEP_S,
        # Terms of the wind have no value without one.
        wind="value + WIND" if one.needs_wind else "value[AIR] != 0.0 ? value + WIND : NULL",
        modes="\n".join(f"FUNCTION({mode})(void *instance) {{ (void)instance; return fmi3OK; }}" for mode in _MODES),
        unsupported="\n".join(_stubs()),
        **{name: PLACE[name] for name in _PLACES},
    )


def token(one: Exported) -> str:
    """Return what an importer has to give back: it changes with the model and with the code."""
    return f"{one.sha256[:32]}-{__version__}"


def _stubs() -> Iterator[str]:
    for name, kind in _TYPES:
        for way, const in (("Get", ""), ("Set", "const ")):
            # A constant pointer to constant characters, and constant numbers.
            values = f"{kind}const *values" if way == "Set" and kind.endswith("*") else f"{const}{kind} *values"
            yield _stub(
                f"{way}{name}", f"{_REFERENCES}, {values}, size_t m", "n || m ? fmi3Error : fmi3OK", used=("n", "m")
            )
    for name, arguments in _UNSUPPORTED.items():
        yield _stub(name, arguments, "fmi3Error")


def _stub(name: str, arguments: str, result: str, used: tuple[str, ...] = ()) -> str:
    names = [one.split("*")[-1].split(" ")[-1] for one in arguments.split(", ") if one]
    unused = " ".join(f"(void){one};" for one in ("instance", *names) if one not in used)
    whole = ", ".join(filter(None, ("void *instance", arguments)))
    return f"FUNCTION({name})({whole}) {{ {unused} return {result}; }}"
