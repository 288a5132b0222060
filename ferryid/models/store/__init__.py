"""The model store: numbered versions of named models."""

from ferryid.models.store.listing import list_versions
from ferryid.models.store.versions import StoredModel, assign_version, check_name, find, load, load_file, plan, save

__all__ = [
    "StoredModel",
    "assign_version",
    "check_name",
    "find",
    "list_versions",
    "load",
    "load_file",
    "plan",
    "save",
]
