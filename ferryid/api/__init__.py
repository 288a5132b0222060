"""The public Python API: one call for each command, with its settings as typed arguments and its result as an `Outcome`.

```python
from ferryid import api

fit = api.fit("bag.mcap")
print(fit)              # as the terminal shows it; a notebook shows the report
fit.json["scores"]      # as --json writes it
fit.stored.model        # the model itself
```

The commands call these functions and nothing else. Each raises `ferryid.errors.FerryIdError`, with the file, the cause and
the remedy, for input that cannot be used; nothing half-written is left. Importing this module imports nothing heavy.
"""

from __future__ import annotations

from ferryid.api.archive import batch, doctor
from ferryid.api.arguments import OUT as OUT
from ferryid.api.arguments import Logs as Logs
from ferryid.api.arguments import Progress as Progress
from ferryid.api.arguments import Ranges as Ranges
from ferryid.api.diagnosis import compare_groups, diagnose, plan
from ferryid.api.fitting import compare, evaluate, fit, sweep
from ferryid.api.logs import ingest, inspect
from ferryid.api.profiles import check_vessel, new_vessel, vessels
from ferryid.api.simulation import prove, reproduce, scenarios, simulate
from ferryid.api.store import export, models, promote, roll_back, show_model

__all__ = [
    "batch",
    "check_vessel",
    "compare",
    "compare_groups",
    "diagnose",
    "doctor",
    "evaluate",
    "export",
    "fit",
    "ingest",
    "inspect",
    "models",
    "new_vessel",
    "plan",
    "promote",
    "prove",
    "reproduce",
    "roll_back",
    "scenarios",
    "show_model",
    "simulate",
    "sweep",
    "vessels",
]
