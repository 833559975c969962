"""Limits of memory and time for jobs, and how many run at once.

Memory: $PARADIZE_MEMORY, else 80 % of the memory that is available on this machine or in the control group of
this process. Known on Linux only; elsewhere there is no limit. Time: $PARADIZE_TIMEOUT, else half an hour,
and more for large inputs. Number: $PARADIZE_JOBS, else one per core.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

from paradize.errors import BakeError
from paradize.kernels.threads import VARIABLE as THREADS_VARIABLE

VARIABLE = "PARADIZE_MEMORY"
TIME_VARIABLE = "PARADIZE_TIMEOUT"
JOBS_VARIABLE = "PARADIZE_JOBS"
_TIMEOUT_S = 1800.0
SHARE = 0.8  # of the memory that is available
_UNITS = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}
_UNITS |= {f"{letter}i": 1024**power for power, letter in enumerate("KMGT", 1)}
_LIMIT = re.compile(r"(\d+(?:\.\d+)?)(%|[KMGT]i?)?B?", re.ASCII)
_COUNT = re.compile(r"[1-9]\d{0,3}", re.ASCII)
_SECONDS = re.compile(r"\d{1,9}(?:\.\d+)?", re.ASCII)
_RESIDENT = re.compile(rb"^Rss(?:Anon|Shmem):\s*(\d+) kB", re.MULTILINE)
_GROUP_FILES = (  # limit and usage in control groups of version 2 and 1
    ("memory.max", "memory.current"),
    ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"),
)


def memory_limit() -> int | None:
    """The memory that all running jobs may use together, in bytes; None where it is unknown.

    $PARADIZE_MEMORY is an amount (4G, 500Mi) or a share of the available memory (50%). Raises BakeError for
    anything else.
    """
    text = os.environ.get(VARIABLE, "").strip()
    if not text:
        free = available()
        return None if free is None else int(SHARE * free)
    match = _LIMIT.fullmatch(text)
    if match is None or not (amount := float(match[1])) or (match[2] == "%" and amount > 100.0):
        what = f"is {text!r}; expected bytes or a share of the available memory"
        raise BakeError(what, file=f"${VARIABLE}", mend="write bytes (4G, 500Mi) or a share (50%)")
    if match[2] == "%":
        free = available()
        return None if free is None else int(amount / 100.0 * free)
    return int(amount * _UNITS[match[2] or ""])


def time_limit(expected_s: float = 0.0) -> float:
    """Seconds after which a job counts as hanging: $PARADIZE_TIMEOUT, else the larger of half an hour and
    expected_s. Raises BakeError where the variable is not a positive number."""
    text = os.environ.get(TIME_VARIABLE, "").strip()
    if not text:
        return max(_TIMEOUT_S, expected_s)
    if not _SECONDS.fullmatch(text) or not float(text):
        what = f"is {text!r}; expected seconds above 0"
        raise BakeError(what, file=f"${TIME_VARIABLE}", mend="write a number of seconds, such as 3600")
    return float(text)


def default_jobs() -> int:
    """How many jobs run at once unless a command says it: $PARADIZE_JOBS, else the number of cores. Raises
    BakeError where the variable is not a whole number from 1 to 9999."""
    return _count(JOBS_VARIABLE, "worker processes") or cores()


def given_threads() -> int | None:
    """$PARADIZE_THREADS; None where it is not set. Raises BakeError as `default_jobs`."""
    return _count(THREADS_VARIABLE, "threads")


def _count(variable: str, unit: str) -> int | None:
    text = os.environ.get(variable, "").strip()
    if not text:
        return None
    if not _COUNT.fullmatch(text):
        what = f"is {text!r}; expected a whole number from 1 to 9999"
        raise BakeError(what, file=f"${variable}", mend=f"write a number of {unit}, such as 2")
    return int(text)


def available() -> int | None:
    """Bytes that a process can still allocate without swapping; None where that is unknown."""
    try:
        line = re.search(rb"^MemAvailable:\s*(\d+) kB", Path("/proc/meminfo").read_bytes(), re.MULTILINE)
    except OSError:
        return None
    if line is None:
        return None
    free = int(line[1]) * 1024
    group = Path("/sys/fs/cgroup")
    for most, used in _GROUP_FILES:
        try:
            free = min(free, int((group / most).read_text()) - int((group / used).read_text()))
        except (OSError, ValueError):  # no such group, or `max`
            continue
    return max(free, 0)


def process_memory(process: int) -> int:
    """Anonymous and shared memory of a process and its children in bytes (file mappings are not counted). 0
    where it is unknown or the process has ended."""
    try:
        status = Path(f"/proc/{process}/status").read_bytes()
        total = 1024 * sum(int(number) for number in _RESIDENT.findall(status))
        for task in os.listdir(f"/proc/{process}/task"):  # noqa: PTH208 (numbers only)
            children = Path(f"/proc/{process}/task/{task}/children").read_bytes()
            total += sum(process_memory(int(child)) for child in children.split())
    except (OSError, ValueError):
        return 0
    return total


def cores() -> int:
    """The number of processors that this process may use."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
