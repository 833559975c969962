"""SIGINT and SIGTERM end a command with one line and exit code 130, whatever it is at."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.pipeline.scenes import make_cove
from tests.sweeps import sweep

# Sends a signal at the Nth call or return of a Python function after the program's first call, which takes
# signals over; for 0 it says how many there are.
PROGRAM = """
import os, signal, sys
from paradize.__main__ import start
at, number = int(sys.argv[1]), int(sys.argv[2])
sys.argv = ["paradize", *sys.argv[3:]]
count = 0
def profile(frame, event, argument):
    global count
    count += bool(count) or (event == "return" and frame.f_code.co_name == "leave_at_once")
    if at and count == at:
        sys.setprofile(None)
        os.kill(os.getpid(), number)
    if not at and frame.f_code.co_name == "ignore":
        sys.setprofile(None)
        sys.stderr.write(str(count))
sys.setprofile(profile)
start()
"""
LINE = "paradize: interrupted; nothing half-written stays"
AT_ONCE = "paradize: ended at once; files that were being written aside may stay"


def run(at: int, number: int, words: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, str(at), str(number), *words],
        cwd=folder,
        env={**os.environ, "PARADIZE_STORE": str(folder / "store"), "PARADIZE_REPORT": ""},
        capture_output=True,
        text=True,
        timeout=300,
    )


COMMANDS = [
    ["mesh", "post.obj", "-o", "m.glb", "--json"],
    ["bake", "cove.toml", "-o", "out", "--force", "-j", "1"],
    ["new", "n"],
    ["explain", "cove.toml", "-o", "out"],
    ["--version"],
]


@pytest.mark.parametrize(
    "words",
    sweep(COMMANDS, test=[words for words in COMMANDS if words[0] == "mesh"]),
    ids=lambda words: words[0],
)
@pytest.mark.parametrize("steps", sweep([2, 4, 12], test=[2]))
def test_a_signal_at_any_call_ends_a_command_with_one_line(
    words: list[str], steps: int, tmp_path: Path
) -> None:
    make_cove(tmp_path)
    count = int(run(0, signal.SIGTERM, words, tmp_path).stderr.splitlines()[-1])
    ended = 0
    for step in range(steps):
        at = 2 + (count - 2) * step // steps
        shutil.rmtree(tmp_path / "n", ignore_errors=True)  # `new` refuses a folder that it finished before
        ran = run(at, (signal.SIGTERM, signal.SIGINT)[step % 2], words, tmp_path)
        if ran.returncode == 0:  # waiting for workers takes fewer calls on a quiet machine
            continue
        assert ran.returncode == 130 and ran.stderr.splitlines()[-1] in (LINE, AT_ONCE), (at, ran)
        assert "Traceback" not in ran.stderr and "Exception" not in ran.stderr, (at, ran.stderr)
        if "--json" in words and LINE in ran.stderr:
            assert json.loads(ran.stdout) == {"error": [LINE.partition(": ")[2]]}
        ended += 1
    assert ended > steps // 3


AFTERWARDS = """
import os, signal, sys
from paradize.cli import clean, main
{meanwhile}
clean.run = lambda arguments: call()
sys.exit(main.main(["clean"]))
"""
MEANWHILE = {
    "an error that a library makes of it": """
def call():
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        for _ in range(1000): pass
    except KeyboardInterrupt:
        raise ImportError("PyCapsule_Import could not import")
""",
    "a destructor": """
class Thing:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000): pass
def call():
    Thing()
    return 0
""",
    "a second signal while the first is dealt with": """
def call():
    try:
        os.kill(os.getpid(), signal.SIGTERM)
        for _ in range(1000): pass
    finally:
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000): pass
""",
}


@pytest.mark.parametrize("what", MEANWHILE)
def test_an_interrupt_counts_where_python_or_a_library_drops_it(what: str) -> None:
    program = AFTERWARDS.format(meanwhile=MEANWHILE[what])
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300)
    line = LINE if what.startswith("an error") else AT_ONCE  # where no `finally` runs, files may stay
    assert (ran.returncode, ran.stderr.splitlines()) == (130, [line])


def test_an_interrupt_waits_until_a_native_module_is_loaded() -> None:
    """nanobind aborts where Python's enum, which it calls meanwhile, raises."""
    meanwhile = """
from enum import EnumType
def profile(frame, event, argument):
    if frame.f_code is EnumType.__prepare__.__func__.__code__ and frame.f_back.f_code.co_name != "call":
        sys.setprofile(None)
        os.kill(os.getpid(), signal.SIGTERM)
def call():
    sys.setprofile(profile)
    import OpenImageIO
    sys.setprofile(None)
    signal.pause()
"""
    program = AFTERWARDS.format(meanwhile=meanwhile)
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300)
    assert (ran.returncode, ran.stderr.splitlines()) == (130, [LINE])


def test_an_interrupt_counts_while_the_options_are_loaded_where_python_makes_another_error_of_it() -> None:
    """Python 3.11 raises RuntimeError for what __set_name__ raises, as in the class body of a dataclass."""
    program = """
import os, signal, sys
from paradize.cli import main
class Field:
    def __set_name__(self, owner, name):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000): pass
def parser(only=None):
    type("Settings", (), {"field": Field()})
main.parser = parser
sys.exit(main.main(["--version"]))
"""
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300)
    assert (ran.returncode, ran.stderr.splitlines()) == (130, [LINE])


def test_a_process_started_to_ignore_interrupts_goes_on_ignoring_them(tmp_path: Path) -> None:
    """As nohup and shells that start it in the background do."""
    program = AFTERWARDS.format(
        meanwhile="def call():\n    os.kill(os.getpid(), signal.SIGINT)\n    return 7"
    )
    command = ["bash", "-c", 'trap "" INT; exec "$0" -c "$1"', sys.executable, program]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert (ran.returncode, ran.stderr) == (7, "")


def test_workers_leave_an_interrupt_of_the_whole_group_to_their_parent(tmp_path: Path) -> None:
    """Ctrl-C in a terminal reaches workers, too, while their interpreters still start."""
    program = """
import os, queue, signal
from paradize.jobs.process import Job, start_worker
answers = queue.SimpleQueue()
worker = start_worker(answers, 1, None)
os.kill(worker.process.pid, signal.SIGINT)
worker.send(Job("id", os.getpid, {}), 1)
print(answers.get(timeout=300).value == worker.process.pid)
worker.stop()
"""
    ran = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=300)
    assert (ran.stdout, ran.stderr) == ("True\n", "")
