"""README.md keeps its word: its five lines work as printed, and its figures are those of the bench's page."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from paradize.cli.main import main
from tests.conftest import RENDER_ENVIRONMENT
from tests.pipeline.scenes import write_image
from tests.places import ROOT

README = (ROOT / "README.md").read_text()
BOX = """mtllib my.mtl
v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 2 1\nv 1 2 1\nv 1 2 -1\nv -1 2 -1
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl paint
f 1/1 2/2 6/3 5/4\nf 2/1 3/2 7/3 6/4\nf 3/1 4/2 8/3 7/4\nf 4/1 1/2 5/3 8/4\nf 5/1 6/2 7/3 8/4
"""


def section(title: str) -> str:
    return README.split(f"\n## {title}\n")[1].split("\n## ")[0]


def five_lines() -> str:
    lines = section("Your own model").split("```")[1].strip()
    assert len(lines.splitlines()) == 5
    return lines


def write_box(folder: Path) -> None:
    """The user's model, red on the left, blue on the right."""
    (folder / "my.obj").write_text(BOX)
    (folder / "my.mtl").write_text("newmtl paint\nmap_Kd paint.png\n")
    paint = np.zeros((64, 64, 3), np.uint8)
    paint[:, :32, 0] = paint[:, 32:, 2] = 220
    write_image(folder / "paint.png", paint)


def require_box(file: Path) -> None:
    picture = np.asarray(Image.open(file).convert("RGB")).astype(int)
    red, green, blue = (picture[..., channel] for channel in range(3))
    for shown in (red - np.maximum(green, blue), blue - np.maximum(red, green)):
        assert (shown > 60).mean() > 0.005


def test_five_lines_lead_to_a_small_picture_in_this_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, player: Callable[..., Any]
) -> None:
    """Its picture is smaller, and without passes whose shaders take long."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    write_box(tmp_path)
    _, *commands, shown = (line.partition("#")[0].split() for line in five_lines().splitlines())
    assert [words[1] for words in commands] == ["new", "bake", "check"]
    for program, *words in commands:
        assert program == "paradize"
        assert main(words) == 0, words
    assert shown[0] == "paradize-player" and shown[-2:] == ["--screenshot", "mine.png"]
    done = player(*shown[1:], "--size", "160x90", "--disable", "shadow,sky,terrain,post")
    assert done.returncode == 0, done.stderr
    require_box(tmp_path / "mine.png")


@pytest.mark.deep
def test_five_lines_lead_to_a_picture_of_the_user_s_textured_model(tmp_path: Path) -> None:
    """In a folder whose build/venv and build/bin are those that `make setup` left."""
    (tmp_path / "build").mkdir()
    for name in ("venv", "bin"):
        (tmp_path / "build" / name).symlink_to(ROOT / "build" / name)
    write_box(tmp_path)
    environment = {**os.environ, **RENDER_ENVIRONMENT, "PARADIZE_STORE": str(tmp_path / "store")}
    ran = subprocess.run(
        ["bash", "-euc", five_lines()],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    require_box(tmp_path / "mine.png")


def test_its_figures_are_those_of_the_bench_s_page() -> None:
    page = (ROOT / "tests/bench/README.md").read_text()
    rows = [line for line in section("Five figures").splitlines() if line.startswith("| ")][2:]
    assert len(rows) == 5
    for row in rows:
        _, figure, command = row.strip("| ").split(" | ")
        found = [line for line in page.splitlines() if command in line]
        numbers = re.findall(r"\d+(?:\.\d+)?", figure)
        assert any(all(number in line for number in numbers) for line in found), row
