"""Seven moments of the flight, and the contact sheet of the palm, look as a person last approved them.

To approve a wanted change, look at build/golden/*.png and copy them over tests/golden/.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from paradize.report.folder import draw_folder
from tests.pictures import MAX_FLIP, MAX_OUTLIERS, MAX_TILE_FLIP, difference, load, require_like, save
from tests.sweeps import sweep

# Open sea, bar, beach by day, under the palm, lagoon, dusk, night.
MOMENTS_S = (10, 40, 62, 85, 118, 165, 214)
SIZE = "640x360"
POSTER_SIZE = "1280x720"


def require_as_approved(
    name: str,
    time_s: float,
    size: str,
    island: Path,
    root: Path,
    player: Callable[..., subprocess.CompletedProcess[str]],
) -> None:
    rendered = root / "build/golden" / name
    rendered.parent.mkdir(parents=True, exist_ok=True)
    result = player(island, "--time", time_s, "--size", size, "--screenshot", rendered)
    assert result.returncode == 0, result.stderr
    require_like(root / "tests/golden" / name, rendered)


@pytest.mark.parametrize("time_s", sweep(MOMENTS_S, test=[214]))
def test_moment_of_the_flight_looks_as_approved(
    time_s: int, island: Path, root: Path, player: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    require_as_approved(f"island_{time_s:03d}.png", time_s, SIZE, island, root, player)


@pytest.mark.deep
def test_the_readme_s_picture_is_what_the_player_draws(
    island: Path, root: Path, player: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    poster_s = json.loads((island / "scene.json").read_text())["poster_s"]
    require_as_approved("poster.png", poster_s, POSTER_SIZE, island, root, player)


@pytest.mark.deep
def test_the_readme_s_contact_sheet_is_what_the_bake_draws(island: Path, root: Path, tmp_path: Path) -> None:
    """Half the size and 256 colours: a README is read over a network."""
    scene = json.loads((island / "scene.json").read_text())
    scene["objects"] = []
    scene["artifacts"] = {
        name: one for name, one in scene["artifacts"].items() if re.fullmatch("palm_(?!mesh).*", name)
    }
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    for artifact in scene["artifacts"].values():
        (tmp_path / artifact["file"]).symlink_to(island / artifact["file"])
    sheets = draw_folder(tmp_path, tmp_path)
    assert (sheets.warnings, sheets.drawn) == ([], [tmp_path / "palm.png"])
    rendered = root / "build/golden/sheet_palm.png"
    rendered.parent.mkdir(parents=True, exist_ok=True)
    with Image.open(tmp_path / "palm.png") as sheet:
        sheet.convert("RGB").reduce(2).quantize(256).save(rendered, optimize=True)
    assert rendered.stat().st_size < 400_000
    require_like(root / "tests/golden/sheet_palm.png", rendered)


@pytest.mark.deep
def test_the_rule_sees_a_small_hole_and_a_faint_drift(root: Path, tmp_path: Path) -> None:
    golden = root / "tests/golden" / f"island_{MOMENTS_S[0]:03d}.png"
    same = tmp_path / "same.png"
    shutil.copy(golden, same)
    assert difference(golden, same) == {"outliers": 0.0, "flip": 0.0, "tile": 0.0}
    hole = load(golden)
    hole[64:96, 64:96] = 0
    save(tmp_path / "hole.png", hole)
    found = difference(golden, tmp_path / "hole.png")
    assert found["tile"] > MAX_TILE_FLIP
    assert found["outliers"] > MAX_OUTLIERS
    save(tmp_path / "drift.png", np.clip(load(golden) + 3 / 255, 0, 1))
    assert difference(golden, tmp_path / "drift.png")["flip"] > MAX_FLIP
