"""How much memory jobs may take together, how much a process and its children hold, how long a job may take.

Memory: $PARADIZE_MEMORY, else four fifths of what the machine, or the control group that holds this process,
still has. Measured on Linux; elsewhere nothing is known, and nothing is limited. Time: $PARADIZE_TIMEOUT,
else half an hour, and more for large inputs.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

from paradize.errors import BakeError

VARIABLE = "PARADIZE_MEMORY"
TIME_VARIABLE = "PARADIZE_TIMEOUT"
_TIMEOUT_S = 1800.0
SHARE = 0.8  # of the memory that is available
_UNITS = {"": 1, "K": 10**3, "M": 10**6, "G": 10**9, "T": 10**12}
_UNITS |= {f"{letter}i": 1024**power for power, letter in enumerate("KMGT", 1)}
_LIMIT = re.compile(r"(\d+(?:\.\d+)?)(%|[KMGT]i?)?B?", re.ASCII)
_SECONDS = re.compile(r"\d{1,9}(?:\.\d+)?", re.ASCII)
_HELD = re.compile(rb"^Rss(?:Anon|Shmem):\s*(\d+) kB", re.MULTILINE)
_GROUP_FILES = (  # of control groups, version 2 and 1: the most, and what is used
    ("memory.max", "memory.current"),
    ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"),
)


def memory_limit() -> int | None:
    """Bytes that all running jobs may take together; None where nothing is known of this machine's memory.

    $PARADIZE_MEMORY: bytes (4G, 500Mi) or a share of what is available (50%). Raises BakeError for others.
    """
    told = os.environ.get(VARIABLE, "").strip()
    if not told:
        free = available()
        return None if free is None else int(SHARE * free)
    found = _LIMIT.fullmatch(told)
    if found is None or not (amount := float(found[1])) or (found[2] == "%" and amount > 100.0):
        mend = "write bytes (4G, 500Mi) or a share of what is available (50%)"
        raise BakeError(f"is no amount of memory: {told!r}", file=f"${VARIABLE}", mend=mend)
    if found[2] == "%":
        free = available()
        return None if free is None else int(amount / 100.0 * free)
    return int(amount * _UNITS[found[2] or ""])


def time_limit(expected_s: float = 0.0) -> float:
    """Seconds after which a job counts as hanging: $PARADIZE_TIMEOUT, else half an hour or what is expected,
    whichever is more. Raises BakeError where the variable is no time."""
    told = os.environ.get(TIME_VARIABLE, "").strip()
    if not told:
        return max(_TIMEOUT_S, expected_s)
    if not _SECONDS.fullmatch(told) or not float(told):
        mend = "write seconds, more than 0"
        raise BakeError(f"is no time: {told!r}", file=f"${TIME_VARIABLE}", mend=mend)
    return float(told)


def available() -> int | None:
    """Bytes that a process here can still get without swapping; None where that is not known."""
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


def held_bytes(process: int) -> int:
    """What a process and its children hold that no file backs; 0 where that is not known or it is gone."""
    try:
        status = Path(f"/proc/{process}/status").read_bytes()
        held = 1024 * sum(int(number) for number in _HELD.findall(status))
        for task in os.listdir(f"/proc/{process}/task"):  # noqa: PTH208 (numbers only)
            children = Path(f"/proc/{process}/task/{task}/children").read_bytes()
            held += sum(held_bytes(int(child)) for child in children.split())
    except (OSError, ValueError):
        return 0
    return held


def cores() -> int:
    """The processors that this process may run on."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
