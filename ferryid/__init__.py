"""ferryid: offline system identification for autonomous ferries and other small vessels.

Importing this package imports nothing heavy, writes nothing and configures nothing.
"""

__version__ = "0.1.0"
