"""The command line: one module ``cmd_<name>`` per command; adding a command is adding one file."""
