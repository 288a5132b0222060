"""The entry of the command line: its error boundary and its exit codes."""

from __future__ import annotations

import os
import signal
import sys
import traceback
import warnings
from types import FrameType
from typing import TYPE_CHECKING

import ferryid
from ferryid.errors import FerryIdError, one_line, printable

if TYPE_CHECKING:
    from typer.exceptions import TyperException

# Products here are small: threads cost more than they give, and on a busy machine many times more. Read when NumPy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


class _Terminated(BaseException):
    """The process is asked to end; what is half done is cleaned up on the way out, as after an interrupt."""


def _terminate(number: int, frame: FrameType | None) -> None:
    raise _Terminated


def main() -> None:
    """Run the command line.

    Exit codes: 0 done, 1 a bug of ours, 2 unusable input, 3 model not accepted, 130 interrupted, 143 terminated.
    """
    _open_streams()
    if sys.argv[1:] == ["--version"]:
        # What scripts ask most often needs no parser.
        sys.stdout.write(f"ferryid {ferryid.__version__}\n")
        return
    from typer.exceptions import TyperException

    from ferryid.cli.app import app

    signal.signal(signal.SIGTERM, _terminate)
    # What NumPy cannot compute becomes NaN, and is told where it matters.
    warnings.simplefilter("ignore", RuntimeWarning)
    try:
        # Its name does not hang on how it is run: shells ask for completion by it.
        code = app(prog_name="ferryid", standalone_mode=False)
        sys.stdout.flush()
    except TyperException as error:
        sys.exit(_usage(error))
    except FerryIdError as error:
        sys.stderr.write(f"ferryid: {error}\n")
        sys.exit(2)
    except _Terminated:
        code = 143
    except KeyboardInterrupt:
        code = 130
    except BrokenPipeError:
        # The reader of our output (head, less) has gone: nothing to say and nobody to say it to.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except OSError as error:
        what = f"{error.filename}: " if error.filename else ""
        sys.stderr.write(
            f"ferryid: {one_line(f'{what}{error.strerror or error}')}. Fix: check the path, its permissions and the disk\n"
        )
        sys.exit(2)
    except MemoryError:
        sys.stderr.write("ferryid: there is not enough memory for this log. Fix: cut it, or give a lower --rate\n")
        sys.exit(2)
    except Exception:  # noqa: BLE001 - the last boundary: what arrives here is a bug and is shown as one
        traceback.print_exc()
        sys.stderr.write(
            f"ferryid {ferryid.__version__}: this is a bug of ferryid. Please report it with these lines\n"
        )
        sys.exit(1)
    if code in (130, 143):
        sys.stderr.write("ferryid: interrupted, nothing half-written was left\n")
    sys.exit(code if isinstance(code, int) else 0)


def _open_streams() -> None:
    """Give output that was closed before we started (``>&-``) a place to go; a log must not take its number either."""
    for name, number in (("stdin", 0), ("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            null = os.open(os.devnull, os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
            setattr(sys, name, os.fdopen(number, "r" if number == 0 else "w", encoding="utf-8"))


def _usage(error: TyperException) -> int:
    """Show wrong use of the command line in one line; asking for nothing at all shows the help."""
    message = error.format_message() if hasattr(error, "format_message") else str(error)
    if "\n" in message:
        sys.stderr.write(printable(message, keep="\n") + "\n")
        return 2
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "ferryid"
    sys.stderr.write(f"ferryid: {one_line(message.rstrip('.'))}. Fix: see {command} --help\n")
    return 2
