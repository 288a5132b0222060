"""ferryid: offline system identification for autonomous ferries and other small vessels.

Importing this package imports nothing heavy, writes nothing and configures nothing.
"""

__version__ = "0.1.0"

TYPE_CHECKING = False
"""As of `typing`, which takes longer to import than this package: a type checker reports what is not here."""

if not TYPE_CHECKING:

    def __getattr__(name: str) -> object:
        """Say where the calls of the Python API are: subpackages have the names of some, so that they cannot be here."""
        raise AttributeError(
            f"module {__name__!r} has no attribute {name!r}: the calls of the Python API are in ferryid.api "
            "(from ferryid import api)"
        )
