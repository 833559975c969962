"""The findings of `check` in a UV layout follow from what its triangles show of the picture."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

from paradize.bakers.authored.bake import bake_authored
from paradize.bakers.color import bake_color
from paradize.bakers.mesh.bake import bake_mesh
from paradize.checks.layouts import _painted, check_layout, check_layouts
from paradize.readers.model import read_model
from tests.pipeline.heights import save
from tests.pipeline.layouts import cards, rect
from tests.player.synthetic import texture


@pytest.mark.parametrize(("drawn", "said"), [(2, []), (32, ["PZ232"])])
def test_overlap_counts_where_something_is_drawn_and_not_on_gradients(
    tmp_path: Path, drawn: int, said: list[str]
) -> None:
    """Two cards share a gradient. A card of 8 x `drawn` texels shows a drawing twice."""
    board = np.repeat(np.arange(60, 252, 3, dtype=np.uint8)[:, None, None], 64, axis=1).repeat(3, axis=2)
    board[4 : 4 + drawn : 2, 36:44] = 255
    shared = [rect(4, 4, 28, 60)] * 2 + [rect(36, 4, 44, 4 + drawn)] * 2
    (tmp_path / "kit.obj").write_text(cards(shared, 64))
    texture = bake_color(save(tmp_path / "kit.png", board)).data
    mesh = read_model(tmp_path / "kit.obj").mesh
    assert mesh.uvs is not None
    findings = check_layout(mesh, mesh.uvs, "kit.glb", lambda: texture)
    assert [finding.code for finding in findings] == said


@pytest.mark.parametrize(
    ("held", "strength", "said"),
    [(None, 1.0, []), ("metalness", 1.0, []), ("occlusion", 0.0, []), ("occlusion", 1.0, ["PZ232"])],
)
def test_overlap_is_told_only_where_an_occlusion_map_shades_it(
    tmp_path: Path, held: str | None, strength: float, said: list[str]
) -> None:
    """A tiled sheet: two quads that show one picture from edge to edge."""
    noise = np.random.default_rng(7).integers(0, 256, (64, 64, 3), np.uint8)
    picture = save(tmp_path / "sheet.png", noise)
    (tmp_path / "sheet.obj").write_text(cards([rect(0, 0, 64, 64)] * 2, 64))
    files = {
        "mesh": bake_mesh(tmp_path / "sheet.obj", lods=1).glb,
        "color": bake_color(picture).data,
    }
    if held:
        shade = save(tmp_path / "shade.png", noise[:, :, :1])
        files["occlusion"] = bake_authored({held: shade}, wrap="repeat")["occlusion"].data
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
    plain = {"gutter": None, "max_level": None, "required_detail": None}
    artifacts = {name: {"file": name, "bytes": len(data), **plain} for name, data in files.items()}
    maps = {"color": "color", "occlusion": "occlusion" if held else None}
    wood = {"maps": maps, "wrap": None, "occlusion_strength": strength}
    manifest = {"objects": [{"mesh": "mesh", "materials": {"wood": wood}}], "artifacts": artifacts}
    assert [finding.code for finding in check_layouts(manifest, tmp_path)] == said


def test_edges_of_a_colour_map_are_found_whatever_channels_it_has() -> None:
    corners = np.array([[[0.4, 0.2], [0.6, 0.2], [0.5, 0.4]], [[0.1, 0.1], [0.2, 0.1], [0.1, 0.2]]])
    for form, channels in (("R8_UNORM", 1), ("RG8_UNORM", 2), ("RGBA8_SRGB", 4)):
        values = np.zeros((16, 16, channels), np.uint8)
        values[:, 8:, 0] = 255
        found = _painted(corners, partial(texture, form, values), 0.1)
        assert found.tolist() == [True, False]
