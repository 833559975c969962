"""`paradize completion`: what real shells then complete."""

from __future__ import annotations

import argparse
import os
import pty
import select
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from paradize.cli.completion import SHELLS, actions_of, completion
from paradize.cli.main import COMMANDS, main, parser

# As bash does at a tab: the words, the place of the one that is completed, the function that is registered.
BASH = """
source script
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=()
[[ $(complete -p paradize) =~ -F\\ ([^ ]+) ]]
"${BASH_REMATCH[1]}" paradize "${COMP_WORDS[-1]}" "${COMP_WORDS[-2]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""
CASES = [
    (["ba"], {"bake"}),
    (["bake", "--ti"], {"--tier"}),
    (["bake", "--tier", "ex"], {"exact"}),
    (["bake", ""], {"isle.toml", "models"}),
    (["mesh", "models/"], {"models/palm.obj"}),
    (["maps", "pic"], {"picture.png"}),
    (["bake", "isle.toml", "-o", ""], {"models"}),
    (["completion", "f"], {"fish"}),
]


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with files of several kinds, and the scripts."""
    (tmp_path / "models").mkdir()
    for name in ("isle.toml", "notes.txt", "picture.png", "models/palm.obj", "models/palm.mtl"):
        (tmp_path / name).touch()
    return tmp_path


def wanted(shell: str) -> str:
    found = shutil.which(shell)
    if found is None:
        pytest.skip(f"no {shell}: install it")
    return found


@pytest.mark.parametrize(("words", "expected"), CASES)
def test_bash_completes_commands_options_and_files_by_suffix(
    place: Path, words: list[str], expected: set[str]
) -> None:
    (place / "script").write_text(completion("bash"))
    (place / "script").rename(place / "models/.script")
    call = ["bash", "-c", BASH.replace("script", "models/.script"), "bash", "paradize", *words]
    result = subprocess.run(call, cwd=place, capture_output=True, text=True, timeout=300, check=True)
    assert set(result.stdout.split()) == expected and result.stderr == ""


@pytest.mark.parametrize(("words", "expected"), CASES)
def test_fish_completes_the_same(place: Path, words: list[str], expected: set[str]) -> None:
    (place / "models/.script").write_text(completion("fish"))
    line = " ".join(["paradize", *words])
    call = [wanted("fish"), "-c", f"source models/.script; complete -C '{line}'"]
    environment = {**os.environ, "HOME": str(place / "models")}
    result = subprocess.run(
        call, cwd=place, env=environment, capture_output=True, text=True, timeout=300, check=True
    )
    found = {row.partition("\t")[0].rstrip("/") for row in result.stdout.splitlines()}
    assert found == expected


def test_zsh_completes_a_line_typed_with_tabs(place: Path) -> None:
    (place / "models/.script").write_text(completion("zsh"))
    start = "PS1=; autoload -U compinit; compinit -u -D; eval \"$(<models/.script)\"; echo rea''dy\r"
    typed = [
        (start, "ready"),
        ("paradize bak\t", "bake "),
        ("--ti\t", "tier "),
        ("ex\t", "exact "),
        ("is\t", "isle.toml "),
    ]
    shell = wanted("zsh")
    process, terminal = pty.fork()
    if process == 0:
        os.chdir(place)
        os.execve(shell, [shell, "-f", "-i"], {**os.environ, "TERM": "dumb", "HOME": str(place)})
    try:
        for send, awaited in typed:
            os.write(terminal, send.encode())
            shown, end = b"", time.monotonic() + 300.0
            while awaited.encode() not in shown:
                assert select.select([terminal], [], [], max(0.0, end - time.monotonic()))[0], (send, shown)
                shown += os.read(terminal, 4096)
    finally:
        os.close(terminal)
        os.waitpid(process, 0)


@pytest.mark.parametrize("shell", SHELLS)
def test_every_option_of_every_command_is_in_every_script(shell: str) -> None:
    script = completion(shell)
    for name in COMMANDS:
        assert name in script
    for action in actions_of(parser()):
        for option in action.option_strings if action.help != argparse.SUPPRESS else ():
            assert option.lstrip("-") in script


def test_the_script_is_printed_for_the_shell_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["completion", "bash"]) == 0
    assert capsys.readouterr().out.rstrip() == completion("bash").rstrip()
    assert main(["completion", "command.com"]) == 2
