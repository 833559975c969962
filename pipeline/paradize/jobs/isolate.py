"""Runs one call in its own process with limits of time and memory, so that a crash or a hang becomes an
error."""

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
    """Returns `call(**arguments)`, run in a fresh process that is killed after `timeout_s`.

    call: a module-level function. arguments and result are pickled. memory_bytes: limit of the process's
    address space (Linux). Starting the process costs about 0.3 s.

    Raises the ParadizeError that the call raised. Raises BakeError, naming `name`, if the process crashed,
    took too long or reached its memory limit.
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
