"""The command line: one module ``cmd_<name>`` per command; adding a command is adding one file."""

INTERRUPTED = b"ferryid: interrupted, nothing half-written was left\n"
"""What is said of an interrupt while no command runs: `ferryid.interrupts` may not be loaded yet."""
