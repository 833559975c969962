"""One call in a process of its own, with limits of time and memory: a crash or a hang becomes an error."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from paradize.jobs.loader import EXPECTED
from paradize.jobs.pool import Job, run_jobs


def call_isolated(
    name: str,
    call: Callable[..., Any],
    arguments: dict[str, Any],
    *,
    timeout_s: float,
    memory_bytes: int | None = None,
) -> Any:
    """`call(**arguments)` in a fresh process, killed after `timeout_s`; memory_bytes bounds its address space
    (Linux). `call` is a module-level function; arguments and result are pickled; starting costs some 0.3 s.

    Raises what the call raised where that is a ParadizeError, and BakeError, naming `name`, where the process
    crashed, took too long, or met its memory limit.
    """
    given = {"call": call, "arguments": arguments, "memory_bytes": memory_bytes}
    job = Job(name, _limited, given, timeout_s, code=dict(EXPECTED))
    (outcome,) = run_jobs([job], 1)
    if outcome.error is not None:
        raise outcome.error
    return outcome.value


def _limited(call: Callable[..., Any], arguments: dict[str, Any], memory_bytes: int | None) -> Any:
    if memory_bytes is not None and sys.platform == "linux":
        import resource

        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        wanted = memory_bytes if hard == resource.RLIM_INFINITY else min(memory_bytes, hard)
        resource.setrlimit(resource.RLIMIT_AS, (wanted, hard))
    return call(**arguments)
