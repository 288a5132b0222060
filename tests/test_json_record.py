"""Records: what is written as JSON comes back as it was, and nothing else is taken for it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from math import inf, isnan, nan
from typing import Any, ClassVar, NamedTuple

import pytest

from ferryid.diagnose.data.estimate import Estimate
from ferryid.json_record import Number, Record, json_key
from ferryid.validation.case import Case, Truth
from ferryid.validation.case_sampling import sample_cases
from ferryid.validation.name_scores import Share
from ferryid.validation.records import Diagnosis, Finding, OracleEstimate, OracleResult, TransferResult, TransferScore


def back(record: Record) -> Any:
    return type(record).from_json(json.loads(json.dumps(record.to_json(), allow_nan=False)))


def test_cases_and_results_come_back_as_they_were() -> None:
    estimate = Estimate(1.0, 0.5, 1.5, "m/s")
    finding = Finding("wind", None, 0.9, {"north": estimate}, {"surge": 0.5}, ("current",), onset=3.0)
    score = TransferScore({"surge": 0.5, "sway": None}, 1.0, why="short", names=())
    for record in (
        *sample_cases(5, 0.2),
        Case("1", "wind", "single", "ferry", "short", "mcap", 7, truths=(Truth("wind", None, {"north": 1.0}, 3.0),)),
        Diagnosis("explained", 2.0, (finding,), ("a note",), after={"ratio": {}}),
        OracleResult(1.5, (OracleEstimate("wind", "a", 1.0, 2, 4.6, {"north": estimate}),), 3.0),
        TransferResult(score, {"diagnosed": score}),
    ):
        made = back(record)
        assert made.to_json() == json.loads(json.dumps(record.to_json()))
        assert type(made) is type(record)


@dataclass(frozen=True)
class Sample(Record):
    DERIVED: ClassVar[Mapping[str, str]] = {"twice": "double"}

    size: float
    pair: tuple[float, float] = (0.0, 0.0)
    values: Mapping[str, float | None] = field(default_factory=dict)

    @property
    def double(self) -> float:
        return 2.0 * self.size


def test_what_is_not_finite_becomes_none_and_properties_are_written() -> None:
    assert Sample(nan, (1.0, inf)).to_json() == {"size": None, "pair": [1.0, None], "values": {}, "twice": None}
    made = back(Sample(nan, (1.0, 2.0), {"a": None}))
    assert isnan(made.size)
    assert (made.pair, made.values) == ((1.0, 2.0), {"a": None})
    assert Share(1, 4).to_json()["value"] == 0.25


class File(NamedTuple):
    path: str
    size: int


@dataclass(frozen=True)
class Listed(Record):
    files: tuple[File, ...] = field(metadata=json_key("paths"))
    seconds: Number
    at: Number | None


def test_keys_other_than_names_arrays_with_names_and_whole_numbers() -> None:
    record = Listed((File("a", 1),), 0, 0.5)
    assert json.dumps(record.to_json()) == '{"paths": [["a", 1]], "seconds": 0, "at": 0.5}'
    made = back(record)
    assert (made, type(made.seconds), made.files[0].size) == (record, int, 1)
    assert back(replace(record, at=None)).at is None
    for other in ({"files": []}, {"paths": [["a"]]}, {"paths": [["a", "1"]]}, {"seconds": True}, {"at": "1"}):
        with pytest.raises(ValueError, match=r"expected|missing|argument|shorter|longer"):
            Listed.from_json({**record.to_json(), **other})


@pytest.mark.parametrize(
    "data", [{}, {"size": "1"}, {"size": 1.0, "colour": 1}, {"size": 1.0, "pair": [1.0]}, [], None, {"size": True}]
)
def test_other_data_is_refused(data: Any) -> None:
    with pytest.raises(ValueError, match=r"expected|missing|argument|shorter|longer"):
        Sample.from_json(data)
