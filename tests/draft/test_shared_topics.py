"""Orders of several actuators on one topic: whether any of them changes in a log."""

from __future__ import annotations

import numpy as np
import pytest

from ferryid.draft.actuator_fields import SharedTopic, constant
from ferryid.draft.samples import Samples

BUS = SharedTopic("/lli_input", ("DevID", "MsgID"), "Data")


@pytest.mark.parametrize(("last", "still"), [(70.0, True), (71.0, False)])
def test_orders_that_differ_between_actuators_and_never_change_are_constant(last: float, still: bool) -> None:
    columns = {"DevID": [10.0] * 6, "MsgID": [3.0, 5.0] * 3, "Data": [70.0, 136.0, 70.0, 136.0, last, 136.0]}
    samples = Samples(
        {"/lli_input": np.arange(6.0)},
        {("/lli_input", name): np.array(values) for name, values in columns.items()},
        np.arange(6.0),
        0,
    )
    assert constant(BUS, samples) is still
    assert not constant(SharedTopic("/other", ("DevID",), "Data"), samples)
