"""How many threads a native kernel takes where its caller does not say: results never depend on it.

`run_jobs` tells a worker process through its environment; without word from there it is what the machine
has, up to what a kernel is worth beside other workers.
"""

from __future__ import annotations

import os

VARIABLE = "PARADIZE_THREADS"


def default_threads(most: int) -> int:
    """The number in $PARADIZE_THREADS, 1 or more; else this machine's cores, `most` at most."""
    told = os.environ.get(VARIABLE, "")
    if told.isascii() and told.isdigit() and int(told[:6]) >= 1:
        return int(told[:6])
    return min(os.cpu_count() or 1, most)
