"""The model store: numbered versions of named models."""

from ferryid.models.store.history import Change, read_history
from ferryid.models.store.listing import list_versions
from ferryid.models.store.versions import (
    NAME,
    StoredModel,
    assign_version,
    check_name,
    current_version,
    find,
    load,
    load_file,
    plan,
    promote,
    roll_back,
    save,
)

__all__ = [
    "NAME",
    "Change",
    "StoredModel",
    "assign_version",
    "check_name",
    "current_version",
    "find",
    "list_versions",
    "load",
    "load_file",
    "plan",
    "promote",
    "read_history",
    "roll_back",
    "save",
]
