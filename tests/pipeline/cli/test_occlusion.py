"""`paradize maps MODEL --only occlusion`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import paradize
from paradize.cli import main as cli
from paradize.formats.png import decode_png
from tests.pipeline.scenes import write_image
from tests.pipeline.shapes import CORNER_OBJ


@pytest.fixture
def corner(tmp_path: Path) -> Path:
    (tmp_path / "corner.obj").write_text(CORNER_OBJ)
    return tmp_path / "corner.obj"


def run(*words: str | Path) -> int:
    return cli.main(["maps", *map(str, words), "--only", "occlusion", "--occlusion-px", "64"])


def test_it_casts_the_occlusion_of_a_model(corner: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(corner, "-o", corner.parent / "out", "--json") == 0
    (row,) = json.loads(capsys.readouterr().out)["maps"].values()
    assert row["format"] == "BC4_UNORM" and (row["width"], row["height"]) == (64, 64)
    assert row["file"] == "corner_occlusion.ktx2" and (corner.parent / "out" / row["file"]).is_file()
    assert 0.0 < row["errors"]["occlusion_cast_mean"] <= row["errors"]["occlusion_cast_p99"] < 0.03
    made = paradize.occlusion(corner, paradize.OcclusionSettings(occlusion_px=64))
    assert made.files["corner_occlusion.ktx2"] == (corner.parent / "out" / row["file"]).read_bytes()
    assert made.texels("occlusion").shape == (64, 64, 1)


def test_a_model_without_normals_may_have_hard_edges_inside_its_layout(tmp_path: Path) -> None:
    """Vertices on such an edge become two, with the same texture coordinates."""
    places = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\n"
    corners = ((0.1, 0.4), (0.9, 0.4), (0.9, 0.1), (0.1, 0.1), (0.1, 0.9), (0.9, 0.9))
    layout = "".join(f"vt {u} {v}\n" for u, v in corners)
    (tmp_path / "fold.obj").write_text(f"{places}{layout}f 1/1 2/2 3/3 4/4\nf 2/2 1/1 5/5 6/6\n")
    assert run(tmp_path / "fold.obj", "-o", tmp_path / "out") == 0


def test_normals_that_a_model_lacks_are_smooth_up_to_the_crease_angle(corner: Path) -> None:
    values = []
    for crease in ("0", "180"):
        assert run(corner, "-o", corner.parent / crease, "--format", "png", "--crease", crease) == 0
        values.append(decode_png(corner.parent / crease / "corner_occlusion.png").astype(int))
    assert np.abs(values[0] - values[1]).max() > 25


def test_it_writes_a_png_for_other_programs(corner: Path) -> None:
    assert run(corner, "-o", corner.parent / "out", "--format", "png") == 0
    values = decode_png(corner.parent / "out/corner_occlusion.png")
    assert values.shape[:2] == (64, 64) and values.min() < 150 and values.max() > 215


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("bare.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "has no texture coordinates"),
        (
            "flat.obj",
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n",
            "has the same occlusion everywhere, 1: a map would show nothing",
        ),
    ],
)
def test_models_that_it_is_of_no_use_for_are_refused_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, text: str, said: str
) -> None:
    (tmp_path / name).write_text(text)
    assert run(tmp_path / name, "-o", tmp_path / "out") == 1
    error = capsys.readouterr().err
    assert name in error and said in error
    assert not (tmp_path / "out").exists()


def test_a_picture_is_no_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_image(tmp_path / "a.png", np.zeros((4, 4, 3), np.uint8))
    assert run(tmp_path / "a.png", "-o", tmp_path / "out") == 1
    assert "is a PNG picture, not an OBJ" in capsys.readouterr().err


def test_occlusion_stands_by_itself(corner: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["maps", str(corner), "-o", "x", "--only", "normal,occlusion"]) == 2
    assert "--only occlusion" in capsys.readouterr().err


def test_materials_are_chosen_by_name(corner: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The floor alone lies on the map; the wall still hides the sky, unless it is see-through."""
    text = corner.read_text().replace("f 1/5", "usemtl wall\nf 1/5")
    corner.write_text(text)
    settings = paradize.OcclusionSettings(occlusion_px=32, layout_materials=("stone",))
    shown = paradize.occlusion(corner, settings, tier="fast").texels("occlusion")
    assert shown[:, :14].min() < 0.6
    assert run(corner, "-o", corner.parent / "out", "--materials", "stone", "--see-through", "wall") == 1
    assert "the same occlusion everywhere" in capsys.readouterr().err
    assert run(corner, "-o", corner.parent / "out", "--materials", "stones") == 1
    assert "no material 'stones'" in capsys.readouterr().err
