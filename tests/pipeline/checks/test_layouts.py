"""The findings of `check` in a UV layout follow from what its triangles show of the picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paradize.bakers.color import bake_color
from paradize.checks.layouts import check_layout
from paradize.readers.model import read_model
from tests.pipeline.heights import save
from tests.pipeline.layouts import cards, rect


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
