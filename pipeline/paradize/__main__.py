"""Where the program `paradize` starts; `python -m paradize` is the same."""

from __future__ import annotations

import sys

from paradize.cli.interrupt import ignore, leave_at_once


def start() -> None:
    """Runs the command line and ends the process with its exit code."""
    leave_at_once()  # loading the rest takes a while
    from paradize.cli.main import main

    code = main()
    ignore()
    sys.exit(code)


if __name__ == "__main__":
    start()
