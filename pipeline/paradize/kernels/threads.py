"""The default number of threads of native kernels. Results never depend on it.

`run_jobs` sets it for its worker processes through the environment. Otherwise it is the number of cores, up
to a limit of each kernel.
"""

from __future__ import annotations

import os
from collections.abc import MutableMapping

VARIABLE = "PARADIZE_THREADS"


def default_threads(limit: int) -> int:
    """$PARADIZE_THREADS if it is 1 or more; else the number of cores, at most `limit`."""
    text = os.environ.get(VARIABLE, "")
    if text.isascii() and text.isdigit() and int(text[:6]) >= 1:
        return int(text[:6])
    return min(os.cpu_count() or 1, limit)


def limit_blas(environment: MutableMapping[str, str]) -> None:
    """Lets a process that gets this environment load numpy without threads for matrix products: nothing here
    has a large one, and their start is 45 of the 104 ms of processor time that loading it takes. A value of
    the user's stays."""
    environment.setdefault("OPENBLAS_NUM_THREADS", "1")
