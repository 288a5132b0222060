"""The entry of the command line: its error boundary and its exit codes."""

from __future__ import annotations

import errno
import gc
import os
import stat
import sys
from typing import TYPE_CHECKING

import ferryid
from ferryid.cli import INTERRUPTED

if TYPE_CHECKING:
    from collections.abc import Callable

    from typer.exceptions import TyperException

# Products here are small: threads cost more than they give, and on a busy machine many times more. Read when NumPy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def main() -> None:
    """Run the command line in a process of its own.

    Exit codes: 0 done, 1 a bug of ours, 2 unusable input, 3 model not accepted, 130 interrupted, 143 terminated.
    """
    try:
        _open_streams()
        if sys.argv[1:] == ["--version"]:
            # What scripts ask most often needs no parser.
            sys.exit(_version())
        from ferryid import interrupts
        from ferryid.report import page_process

        interrupts.end_in_time()
        page_process.allow()
        # Modules and arrays are no circles of references; each search for some goes through all of them.
        gc.set_threshold(50_000, 20, 20)
        try:
            run(last=interrupts.end)
        finally:
            interrupts.by_default()
            # Python looks through all that is left for circles before it ends, which takes up to half a second.
            gc.freeze()
    except KeyboardInterrupt:
        # Before or after the command.
        os.write(2, INTERRUPTED)
        os._exit(130)


def _version() -> int:
    """Print the version and return the exit code."""
    try:
        sys.stdout.write(f"ferryid {ferryid.__version__}\n")
        sys.stdout.flush()
    except BrokenPipeError:
        _drop_output()
    except OSError as error:
        return _failed(error)
    return 0


def run(last: Callable[[int], object] | None = None) -> None:
    """Run the command line and raise `SystemExit` with its exit code.

    Parameters
    ----------
    last
        Called instead with the number of a signal that ended the command.
    """
    from ferryid import interrupts

    code: object = 0
    try:
        with interrupts.raised():
            code = _run()
    except (KeyboardInterrupt, interrupts.Terminated):
        pass
    number = interrupts.received()
    if number and last is not None:
        last(number)
    if number:
        sys.stderr.write(interrupts.MESSAGE)
        code = 128 + number
    sys.exit(code if isinstance(code, int) else 0)


def _run() -> object:
    """Run the command line and return its exit code."""
    import warnings

    from ferryid import interrupts
    from ferryid.cli.error_pages import MEMORY, PLACE, section, see
    from ferryid.errors import FerryIdError, UnwritableError

    # What NumPy cannot compute becomes NaN, and is told where it matters.
    warnings.simplefilter("ignore", RuntimeWarning)
    from typer.exceptions import TyperException

    from ferryid.cli.app import app
    from ferryid.cli.output import progress

    try:
        # Its name does not hang on how it is run: shells ask for completion by it.
        try:
            code = app(prog_name="ferryid", standalone_mode=False)
        finally:
            # An error stands on a line of its own, not behind the stage that it ended.
            progress("")
        sys.stdout.flush()
        return code
    except TyperException as error:
        return _usage(error)
    except FerryIdError as error:
        if not interrupts.received():
            where = PLACE if isinstance(error, UnwritableError) else section(error)
            sys.stderr.write(f"ferryid: {error}{see(where)}\n")
        return 2
    except BrokenPipeError:
        # The reader of our output (head, less) has gone: nothing to say and nobody to say it to.
        _drop_output()
        return 0
    except OSError as error:
        return _failed(error)
    except MemoryError:
        sys.stderr.write(
            f"ferryid: there is not enough memory for this log. Fix: cut it, or give a lower --rate{see(MEMORY)}\n"
        )
        return 2
    except Exception:  # noqa: BLE001 - the last boundary: what arrives here is a bug and is shown as one
        # Libraries make errors of their own of an interrupt.
        if not interrupts.received():
            import traceback

            traceback.print_exc()
            sys.stderr.write(
                f"ferryid {ferryid.__version__}: this is a bug of ferryid. Please report it with these lines\n"
            )
        return 1


def _failed(error: OSError) -> int:
    """Say in one line what the system could not read or write, and return the exit code."""
    from ferryid.cli.error_pages import PLACE, see
    from ferryid.errors import one_line

    what, fix = f"{error.filename}: " if error.filename else "", "check the path, its permissions and the disk"
    if not error.filename and error.errno == errno.ENOSPC and _output_is_full():
        what, fix = "standard output: ", "free some space, or send it elsewhere"
        _drop_output()
    sys.stderr.write(f"ferryid: {one_line(f'{what}{error.strerror or error}')}. Fix: {fix}{see(PLACE)}\n")
    return 2


def _output_is_full() -> bool:
    """Tell whether standard output goes to a full disk, or to a device such as /dev/full."""
    try:
        number = sys.stdout.fileno()
        if stat.S_ISREG(os.fstat(number).st_mode):
            return hasattr(os, "fstatvfs") and os.fstatvfs(number).f_bavail == 0
        return stat.S_ISCHR(os.fstat(number).st_mode) and not os.isatty(number)
    except OSError:
        return False


def _drop_output() -> None:
    """Send what is left of standard output nowhere: Python would try once more at its end, and fail."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


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
    from ferryid.cli.error_pages import OPTION, see
    from ferryid.errors import ended, one_line, printable

    message = error.format_message() if hasattr(error, "format_message") else str(error)
    if "\n" in message:
        sys.stderr.write(printable(message, keep="\n") + "\n")
        return 2
    context = getattr(error, "ctx", None)
    command = context.command_path if context else "ferryid"
    sys.stderr.write(f"ferryid: {ended(one_line(message))} Fix: see {command} --help{see(OPTION)}\n")
    return 2
