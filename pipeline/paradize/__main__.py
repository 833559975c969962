"""Where the program `paradize` starts; `python -m paradize` is the same."""

from __future__ import annotations

import os
import sys

from paradize.cli.interrupt import ignore, leave_at_once
from paradize.kernels.threads import limit_blas


def start() -> None:
    """Runs the command line and ends the process with its exit code."""
    leave_at_once()  # loading the rest takes a while
    limit_blas(os.environ)
    from paradize.cli.main import main

    code = main()
    ignore()
    sys.exit(code)


if __name__ == "__main__":
    start()
