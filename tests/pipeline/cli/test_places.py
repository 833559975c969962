"""The command line in odd places: closed streams, full disks, pipes as input, names that are no text."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.pipeline.scenes import ball, make_cove
from tests.sweeps import sweep

Shell = Callable[[str], "subprocess.CompletedProcess[str]"]
Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def shell(tmp_path: Path, root: Path) -> Shell:
    """Runs a shell line in a folder that holds cove's sources; $P is `paradize`."""
    make_cove(tmp_path)
    environment = {
        **os.environ, "PARADIZE_STORE": str(tmp_path / "store"), "P": str(root / "build/venv/bin/paradize")
    }  # fmt: skip

    def call(line: str) -> subprocess.CompletedProcess[str]:
        result = subprocess.run(
            ["bash", "-c", f"set -o pipefail; {line}"],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert "Traceback" not in result.stderr and "internal error" not in result.stderr, result.stderr
        return result

    return call


@pytest.fixture
def here(tmp_path: Path, paradize_here: Run, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs the words of a line in the same folder, in this process."""
    make_cove(tmp_path)
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    monkeypatch.chdir(tmp_path)

    def call(words: str) -> subprocess.CompletedProcess[str]:
        result = paradize_here(*words.split())
        assert "Traceback" not in result.stderr and "internal error" not in result.stderr, result.stderr
        return result

    return call


CLOSED = ["<&-", ">&-", "2>&-", "<&- >&-", "<&- >&- 2>&-"]


@pytest.mark.parametrize("closed", sweep(CLOSED, test=CLOSED[-1:]))
def test_a_process_without_standard_streams_bakes_all_the_same(shell: Shell, closed: str) -> None:
    message = shell(f"$P maps wood.png -o m --only height --json {closed} && $P check m")
    assert message.returncode == 0, message.stderr
    clean = "1 artifact checked: no finding\n"
    assert message.stdout.endswith(clean)
    if ">&-" not in closed.replace("2>&-", ""):
        assert json.loads(message.stdout.removesuffix(clean))["maps"].keys() == {"height"}


@pytest.mark.deep
def test_a_full_disk_at_standard_output_is_one_message(shell: Shell) -> None:
    for line in ("$P mesh post.obj -o a.glb --json", "$P mesh gone.obj -o a.glb --json", "$P --version"):
        message = shell(f"{line} > /dev/full")
        assert message.returncode == 1 and "standard output cannot be written" in message.stderr


@pytest.mark.deep
def test_a_reader_that_goes_away_costs_no_traceback(shell: Shell) -> None:
    for line in ("$P mesh gone.obj -o a.glb --json", "$P check gone.glb", "$P mesh post.obj -o a.glb"):
        shell(f"{line} | true")


@pytest.mark.parametrize(
    "words",
    ["mesh --json", "mesh post.obj -o a.glb --lods 0 --json", "paint --json", "check --json", "--json"],
)
def test_wrong_usage_is_one_object_too(here: Run, words: str) -> None:
    message = here(words)
    assert message.returncode == 2 and len(json.loads(message.stdout)["error"]) == 1
    assert json.loads(message.stdout)["error"][0] in message.stderr


@pytest.mark.parametrize(
    "words",
    ["mesh post.obj -o a.glb --js", "maps wood.png -o m --uv post.obj --gloss-groups ,"],
)
def test_options_are_neither_abbreviated_nor_empty(here: Run, words: str) -> None:
    assert here(words).returncode == 2


PIPES = [
    "bake fifo",
    "check fifo",
    "check fifo.glb",
    "check /dev/zero",
    "maps fifo -o m",
    "mesh fifo -o a.glb",
]


@pytest.mark.parametrize("words", sweep(PIPES, test=["bake fifo", "check /dev/zero"]))
def test_pipes_and_devices_are_refused_not_waited_for(shell: Shell, words: str) -> None:
    message = shell(f"mkfifo fifo fifo.glb; timeout 20 $P {words}")
    assert message.returncode == 1
    assert any(text in message.stdout + message.stderr for text in ("regular file", "not a file"))


@pytest.mark.deep
def test_a_device_or_a_pipe_is_never_replaced_by_a_baked_file(shell: Shell, tmp_path: Path) -> None:
    shell("mkfifo pipe.glb; ln -s pipe.glb link.glb")
    for name in ("pipe.glb", "link.glb"):
        message = shell(f"$P mesh post.obj -o {name}")
        assert message.returncode == 1 and f"{name}: is not a regular file" in message.stderr
    assert (tmp_path / "pipe.glb").is_fifo() and (tmp_path / "link.glb").is_symlink()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--lods x", "--lods: 'x' is not a whole number"),
        ("--errors 0.1,", "--errors: '' is not a number"),
        ("--lods 3abc", "--lods: '3abc' is not a whole number"),
        ("--lods 0_3", "--lods: '0_3' is not a whole number"),
        ("--errors 0.1_0", "--errors: '0.1_0' is not a number"),
        ("--ratio \uff10.5", "--ratio: '\uff10.5' is not a number"),
        ("--ratio nan", "--ratio: nan is out of range; allowed: 0.05 to 0.95"),
        ("--errors 0.2,0.1", "--errors: 0.2,0.1 is not rising"),
    ],
)
def test_a_value_that_an_option_cannot_take_is_named(here: Run, words: str, said: str) -> None:
    message = here(f"mesh post.obj -o a.glb {words}")
    assert message.returncode == 2 and said in message.stderr


LONG = "n" * 300
IMPOSSIBLE = [
    "mesh post.obj -o /",
    f"mesh post.obj -o {LONG}.glb",
    f"maps {LONG}.png -o m",
    f"terrain {LONG}.png -o a.glb --size 1 1 --height 1",
    f"bake {LONG}.toml",
    f"check {LONG}",
]


@pytest.mark.parametrize("words", sweep(IMPOSSIBLE, test=[IMPOSSIBLE[k] for k in (0, 1, 2, 4)]))
def test_names_that_no_file_can_have_are_one_message(here: Run, words: str) -> None:
    message = here(words)
    assert message.returncode == 1 and len((message.stdout + message.stderr).splitlines()) <= 2


def test_a_current_folder_that_is_gone_is_one_message(shell: Shell, tmp_path: Path) -> None:
    message = shell(f"mkdir gone && cd gone && rmdir ../gone && $P maps {tmp_path}/wood.png -o m")
    assert message.returncode == 1
    assert message.stderr == (
        "paradize: error: the current folder does not exist any more; change into another folder\n"
    )


@pytest.mark.deep
def test_names_that_are_no_text_keep_messages_on_one_line(shell: Shell, tmp_path: Path) -> None:
    strange = "$'a\\xff\\nb\\x1b\\xe2\\x80\\xae'"  # the last: what follows runs from right to left
    message = shell(
        f"cp post.obj {strange}.obj; $P mesh {strange}.obj -o {strange}.glb && $P check {strange}.glb"
    )
    assert message.returncode == 0 and message.stdout.endswith("1 artifact checked: no finding\n")
    assert (
        not {"\x1b", "\u202e"} & set(message.stdout + message.stderr) and "\\nb\\x1b\\u202e" in message.stdout
    )
    message = shell(f"cp wood.png {strange}.png; $P maps {strange}.png -o m --json")
    assert message.returncode == 1 and "not UTF-8" in json.loads(message.stdout)["error"][0]
    assert len(message.stderr.splitlines()) == 1


def test_a_name_as_long_as_a_file_system_takes_can_be_written(here: Run, tmp_path: Path) -> None:
    name = "日" * 83 + ".glb"
    assert here(f"mesh post.obj -o {name}").returncode == 0 and (tmp_path / name).is_file()


@pytest.mark.deep
def test_levels_are_in_the_order_that_check_asks_for(shell: Shell, tmp_path: Path) -> None:
    """On a flat model all levels are exact but for rounding, and rounding has no order."""
    rows = [f"v {x / 10} 0 {z / 10}" for z in range(21) for x in range(21)]
    rows += [f"vt {x / 20} {z / 20}" for z in range(21) for x in range(21)]
    corners = [z * 21 + x + 1 for z in range(20) for x in range(20)]
    rows += [f"f {a}/{a} {a + 21}/{a + 21} {a + 22}/{a + 22} {a + 1}/{a + 1}" for a in corners]
    (tmp_path / "flat.obj").write_text("\n".join(rows) + "\n")
    (tmp_path / "ball.obj").write_text(ball(24))
    result = shell("for name in flat ball; do $P mesh $name.obj -o $name.glb > output; done; $P check *.glb")
    assert result.returncode == 0, result.stdout
