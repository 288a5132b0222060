"""What the console script loads first: from here on an interrupt ends the process with one line and without a traceback.

Loaded by nothing else, as it changes how this process takes signals.
"""

from __future__ import annotations

import os
import signal

from ferryid.cli import INTERRUPTED


def _end(number: int, frame: object) -> None:
    """End the process where nothing has been done yet that is to be undone."""
    os.write(2, INTERRUPTED)
    os._exit(128 + number)


# A shell may have the interrupts of what it runs in the background ignored.
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, _end)

from ferryid.cli.main import main  # noqa: E402

__all__ = ["main"]
