"""Where things are, and what a process of a test tells of itself."""

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# For a script that a test runs: `peak()` is the most memory that the process has had, in bytes. ru_maxrss
# also counts what the process had that started it.
PEAK = """
def peak():
    with open("/proc/self/status") as status:
        return next(1024 * int(line.split()[1]) for line in status if line.startswith("VmHWM"))
"""
# Files that nobody here wrote; not everywhere: ask is_dir().
CORPUS = Path(os.environ.get("PARADIZE_CORPUS", ROOT.parent / "shared" / "corpus"))
# The property under which a test tells how many cases a C++ suite ran: conftest.py adds them up.
CPP_CASES = "cpp_cases"
