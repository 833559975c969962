"""Setup asks a machine for what it lacks, and for nothing else."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
TOOLS = ("bash", "dirname", "grep", "python3", "env", "ldconfig")


def run_debian(
    tmp_path: Path, listed: str, extra: dict[str, str], tools: tuple[str, ...] = TOOLS
) -> subprocess.CompletedProcess[str]:
    """Runs debian.sh over a list of its own, on a PATH that holds `tools` and the scripts in `extra` only."""
    shutil.copy(ROOT / "setup/debian.sh", tmp_path / "debian.sh")
    (tmp_path / "debian.txt").write_text(listed)
    path = tmp_path / "bin"
    path.mkdir()
    for tool in tools:
        where = shutil.which(tool, path=os.environ["PATH"] + ":/sbin:/usr/sbin")
        if where:
            (path / tool).symlink_to(where)
    for name, body in ({"id": "echo 0"} | extra).items():  # of root, where nothing else is said
        (path / name).write_text(f"#!/bin/bash\n{body}\n")
        (path / name).chmod(0o755)
    return subprocess.run(
        [str(path / "bash"), str(tmp_path / "debian.sh"), "run"],
        env={"PATH": str(path)}, capture_output=True, text=True, timeout=300,
    )  # fmt: skip


MISSING = "run command:no-such-command some-package\ntest command:nor-this other-package\n"


def test_nothing_missing_asks_apt_for_nothing(tmp_path: Path) -> None:
    result = run_debian(tmp_path, "run command:bash bash\n", {"apt-get": "echo asked >&2; exit 9"})
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


def test_only_the_asked_list_is_installed(tmp_path: Path) -> None:
    asking = f'echo "$@" >>{tmp_path}/requests'
    result = run_debian(tmp_path, MISSING, {"apt-get": asking, "sudo": '"$@"'})
    assert result.returncode == 0, result.stderr
    requests = (tmp_path / "requests").read_text()
    assert "some-package" in requests
    assert "other-package" not in requests
    assert "DPkg::Lock::Timeout=300" in requests, "a fresh machine updates itself first"


def apt(tmp_path: Path, candidate: str) -> dict[str, str]:
    """An apt that writes down what it is asked for, and knows one version of every package, or none."""
    return {
        "apt-get": f'echo "$@" >>{tmp_path}/requests',
        "apt-cache": f'echo "  Candidate: {candidate}"',
        "sudo": '"$@"',
    }


OPTIONAL = MISSING + "run command:no-browser browser?\n"


@pytest.mark.parametrize(("candidate", "there"), [("1.2-3", True), ("(none)", False)])
def test_a_package_that_can_be_done_without_is_asked_for_where_apt_has_it(
    tmp_path: Path, candidate: str, there: bool
) -> None:
    result = run_debian(tmp_path, OPTIONAL, apt(tmp_path, candidate))
    assert result.returncode == 0, result.stderr
    requests = (tmp_path / "requests").read_text().split()
    assert "some-package" in requests
    assert ("browser" in requests) == there
    assert "browser?" not in requests


def test_only_packages_that_can_be_done_without_missing_is_no_fault(tmp_path: Path) -> None:
    result = run_debian(tmp_path, "run command:no-browser browser?\n", apt(tmp_path, "(none)"))
    assert (result.returncode, result.stdout) == (0, "")
    assert "install" not in (tmp_path / "requests").read_text()


def test_only_packages_that_can_be_done_without_missing_is_no_fault_without_apt(tmp_path: Path) -> None:
    result = run_debian(tmp_path, "run command:no-browser browser?\n", {})
    assert (result.returncode, result.stderr) == (0, "")


ID = {"id": "echo 1000"}


def test_a_plain_user_without_sudo_is_told_the_command_to_run_as_root(tmp_path: Path) -> None:
    asking = {"apt-get": f'echo "$@" >>{tmp_path}/requests'}
    result = run_debian(tmp_path, OPTIONAL, asking | ID)
    assert result.returncode == 1 and not (tmp_path / "requests").exists()
    _, command, others = result.stderr.splitlines()
    assert command.split() == ["apt-get", "install", "some-package"]
    assert others == "Some tests also use: browser"


def test_a_plain_user_without_sudo_does_without_what_can_be_done_without(tmp_path: Path) -> None:
    result = run_debian(tmp_path, "run command:no-browser browser?\n", {"apt-get": "exit 9"} | ID)
    assert (result.returncode, result.stderr) == (0, "")


def test_a_plain_user_hears_what_is_missing_before_sudo_asks_for_a_password(tmp_path: Path) -> None:
    tools = {"apt-get": "true", "sudo": 'echo "password?"; "$@"'}
    result = run_debian(tmp_path, MISSING, tools | ID)
    assert result.returncode == 0, result.stderr
    missing, _, requests, *_ = result.stdout.splitlines()
    assert (missing.split(), requests) == (["missing:", "some-package"], "password?")


@pytest.mark.parametrize("refused", ["update", "install"])
def test_a_sudo_or_an_apt_that_fails_leaves_the_command_to_run_as_root(tmp_path: Path, refused: str) -> None:
    tools = {"apt-get": "true", "sudo": f'[[ "$*" != *{refused}* ]]'}
    result = run_debian(tmp_path, MISSING, tools | ID)
    assert result.returncode == 1
    assert f"apt-get {refused} failed" in result.stderr
    assert result.stderr.splitlines()[-1].split() == ["apt-get", "install", "some-package"]


def test_without_apt_the_exact_list_is_printed(tmp_path: Path) -> None:
    result = run_debian(tmp_path, MISSING, {})
    assert result.returncode == 1
    assert "some-package" in result.stderr
    assert "other-package" not in result.stderr


def test_a_probe_that_finds_not_even_python_says_nothing(tmp_path: Path) -> None:
    listed = "run header:python3.*/Python.h python3-dev\nrun python:ensurepip python3-venv\n"
    without = tuple(tool for tool in TOOLS if tool != "python3")
    result = run_debian(tmp_path, listed, {"apt-get": "true", "sudo": '"$@"'}, without)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("installing: python3-dev python3-venv (")


@pytest.mark.parametrize(
    ("touched", "rebuilt", "left"),
    [
        ("pipeline/paradize/kernels/math/functions.hpp", "building the kernels", "building the player"),
        ("player/main.cpp", "building the player", "building the kernels"),
    ],
)
def test_a_changed_source_rebuilds_its_own_part(touched: str, rebuilt: str, left: str) -> None:
    if not (ROOT / "build/stamps/kernels").exists():
        pytest.skip("build/ was not set up by make")
    # -W: as if the file were new; -n: say, do not do.
    said = subprocess.run(["make", "-n", "-W", touched, "setup"], cwd=ROOT, capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    assert rebuilt in said.stdout
    assert left not in said.stdout


def test_a_python_file_that_moved_is_installed_anew(tmp_path: Path) -> None:
    """An installation finds the package's files by a list that it made."""
    shutil.copy(ROOT / "Makefile", tmp_path)
    package = tmp_path / "pipeline/paradize"
    package.mkdir(parents=True)
    rules = []
    for name in ("a.py", "a.py", "b.py"):
        (package / name).touch()
        said = subprocess.run(["make", "-pnq", "setup"], cwd=tmp_path, capture_output=True, text=True)
        (package / name).unlink()
        rules.append(re.findall("^build/stamps/kernels:.*", said.stdout, re.MULTILINE))
    assert rules[0] == rules[1] != rules[2]


def test_nothing_asks_apt_or_pip_twice_at_once() -> None:
    """Under -j, too: each list of packages waits for the one before."""
    printed = subprocess.run(["make", "-pnq", "setup-test"], cwd=ROOT, capture_output=True, text=True).stdout
    order = ("python-build", "python-run", "openmesh", "kernels", "python-test")
    for later, earlier in (("debian-test", "debian-run"), *zip(order[1:], order, strict=False)):
        rule = next(line for line in printed.splitlines() if line.startswith(f"build/stamps/{later}:"))
        assert f"build/stamps/{earlier}" in rule.split(), f"{later} does not wait for {earlier}"


def step(tmp_path: Path, command: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(ROOT / "setup/step.sh"), "building of/it", "bash", "-c", command],
        cwd=tmp_path, capture_output=True, text=True, timeout=300,
    )  # fmt: skip


def test_a_step_tells_its_time_and_keeps_its_output_in_a_log(tmp_path: Path) -> None:
    result = step(tmp_path, "echo '[1/2] one'; echo two >&2")
    said = result.stdout.splitlines()
    assert (result.returncode, said[0], result.stderr) == (0, "building of/it", "")
    assert len(said) == 2 and said[1].startswith("building of/it: done in ") and said[1].endswith(" s")
    assert (tmp_path / "build/setup/building-of-it.log").read_text() == "[1/2] one\ntwo\n"


def test_a_step_that_fails_ends_with_its_code_and_the_end_of_what_it_printed(tmp_path: Path) -> None:
    result = step(tmp_path, "seq 100; echo 'no such header' >&2; exit 3")
    assert result.returncode == 3
    assert "building of/it failed after" in result.stderr
    assert "build/setup/building-of-it.log" in result.stderr
    assert result.stderr.endswith("\n99\n100\nno such header\n")
    assert "\n50\n" not in result.stderr and "done" not in result.stdout


def test_the_player_waits_for_the_build_tools_only() -> None:
    """So that it is compiled while the other packages are fetched."""
    printed = subprocess.run(["make", "-pnq", "setup"], cwd=ROOT, capture_output=True, text=True).stdout
    rule = next(line for line in printed.splitlines() if line.startswith("build/bin/paradize-player:"))
    assert [word for word in rule.split() if "stamps" in word] == ["build/stamps/python-build"]
    assert re.search("^MAKEFLAGS = .*-j", printed, re.MULTILINE), "steps run one after another"


def test_what_builds_with_ninja_does_not_look_for_the_job_server_of_make() -> None:
    """Under -j it would complain: "Could not initialize jobserver": recipes do not hand it on."""
    builders = [
        line
        for line in (ROOT / "Makefile").read_text().replace("\\\n", "").splitlines()
        if line.startswith("\t") and ("cmake --build" in line or "--no-build-isolation" in line)
    ]
    assert len(builders) >= 4
    assert all("$(alone) " in line for line in builders)


def test_a_wrong_probe_is_refused(tmp_path: Path) -> None:
    result = run_debian(tmp_path, "run smell:roses florist\n", {})
    assert result.returncode == 2
    assert "smell:roses" in result.stderr


def test_a_second_setup_runs_no_recipe() -> None:
    """`make -q` is true when nothing is to be done; only where setup has been done by make itself."""
    if not (ROOT / "build/stamps/kernels").exists():
        pytest.skip("build/ was not set up by make")
    assert subprocess.run(["make", "-q", "setup"], cwd=ROOT, capture_output=True).returncode == 0
