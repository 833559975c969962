"""three.js in headless Chromium, which shares no line with us, shows every level of detail of the palm.

Its silhouettes are compared with a rasteriser of our own in float64 over what the file's reader gives. The
picture with all levels beside each other is left for a person in build/report/three/palm_lods.png.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.bakers.color import bake_color
from paradize.bakers.mesh.bake import bake_mesh
from paradize.data import Mesh
from paradize.formats.glb.reader import decode_glb
from tests.e2e.three import ThreePage, three_page
from tests.pictures import save

HEIGHT = 480
Box = tuple[float, float, float, float]


@dataclass
class Page(ThreePage):
    """The pictures that three.js drew, by name, level and kind: (h, w, 4)."""

    size: tuple[int, int] = (0, 0)
    drawn: dict[tuple[str, int, str], npt.NDArray[np.uint8]] = field(default_factory=dict)

    def take(self, query: dict[str, str], body: bytes) -> None:
        width, height = self.size
        key = query["name"], int(query["level"]), query["kind"]
        self.drawn[key] = np.frombuffer(body, np.uint8).reshape(height, width, 4)

    def show(self, name: str, glb: bytes, box: Box, color: str | None, cutoffs: dict[str, float]) -> Any:
        self.size = width_of(box), HEIGHT
        options = {"width": self.size[0], "height": HEIGHT, "box": box, "color": color, "cutoffs": cutoffs}
        return self.run(f"{name}.glb", glb, f"window.show('{name}', {json.dumps(options)})")["levels"]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with three_page("show_glb.html", Page, tmp_path_factory) as page:
        yield page


def window(mesh: Mesh) -> Box:
    """left, right, bottom, top in metres, a twentieth wider than the mesh."""
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    room = 0.05 * float((high - low).max())
    return float(low[0]) - room, float(high[0]) + room, float(low[1]) - room, float(high[1]) + room


def width_of(box: Box) -> int:
    return round(HEIGHT * (box[1] - box[0]) / (box[3] - box[2]))


def silhouette(mesh: Mesh, box: Box) -> npt.NDArray[np.bool_]:
    """(h, w): whether a triangle covers the pixel's centre, seen along -Z."""
    width = width_of(box)
    x = (mesh.positions[:, 0].astype(float) - box[0]) / (box[1] - box[0]) * width
    y = (box[3] - mesh.positions[:, 1].astype(float)) / (box[3] - box[2]) * HEIGHT
    covered = np.zeros((HEIGHT, width), np.bool_)
    for corner in mesh.triangles:
        px, py = x[corner], y[corner]
        left, right = int(max(np.floor(px.min() - 0.5), 0)), int(min(np.ceil(px.max() + 0.5), width))
        top, bottom = int(max(np.floor(py.min() - 0.5), 0)), int(min(np.ceil(py.max() + 0.5), HEIGHT))
        column, row = np.arange(left, right)[None, :] + 0.5, np.arange(top, bottom)[:, None] + 0.5
        sides = [
            (px[k] - px[k - 1]) * (row - py[k - 1]) - (py[k] - py[k - 1]) * (column - px[k - 1])
            for k in range(3)
        ]
        inside = (sides[0] > 0) & (sides[1] > 0) & (sides[2] > 0)
        inside |= (sides[0] < 0) & (sides[1] < 0) & (sides[2] < 0)
        covered[top:bottom, left:right] |= inside
    return covered


def require_drawn(page: Page, name: str, level: int, mesh: Mesh, box: Box) -> None:
    expected = silhouette(mesh, box)
    found = page.drawn[name, level, "shape"][:, :, 3] > 0
    off = (expected != found).sum()
    assert off <= 0.005 * expected.sum(), f"lod{level}: {off} of {expected.sum()} pixels"


@pytest.fixture(scope="module")
def palm(root: Path) -> bytes:
    return bake_mesh(root / "raw_assets/palm/palm.obj", lods=4).glb


@pytest.mark.deep
def test_three_draws_every_level_of_the_palm_where_its_triangles_are(
    page: Page, palm: bytes, root: Path
) -> None:
    levels = [lod.mesh for lod in decode_glb(palm)]
    box = window(levels[0])
    color = bake_color(
        root / "raw_assets/palm/palm.ppm", alpha=root / "raw_assets/palm/palm_alpha.pgm", wrap="clamp"
    )
    (page.files / "palm.ktx2").write_bytes(color.data)
    report = page.show("palm", palm, box, "palm", {"leaves": 0.43})
    assert [level["name"] for level in report] == [f"lod{k}" for k in range(len(levels))]
    assert [level["triangles"] for level in report] == [len(level.triangles) for level in levels]
    assert all(level["attributes"] == ["normal", "position", "tangent", "uv"] for level in report)
    for number, level in enumerate(levels):
        require_drawn(page, "palm", number, level, box)
    pictures = [page.drawn["palm", k, "light"].astype(np.float32) / 255 for k in range(len(levels))]
    for number, picture in enumerate(pictures):
        shown = picture[picture[:, :, 3] > 0.5]
        assert len(shown) > 0.25 * silhouette(levels[0], box).sum(), f"lod{number} has next to vanished"
        assert shown[:, :3].std(axis=0).max() > 0.05, f"lod{number} has one colour"
    out = root / "build/report/three/palm_lods.png"
    out.parent.mkdir(parents=True, exist_ok=True)
    sky = np.array([0.75, 0.85, 0.95], np.float32)
    save(out, np.concatenate([p[:, :, :3] * p[:, :, 3:] + sky * (1 - p[:, :, 3:]) for p in pictures], axis=1))


@pytest.mark.deep
def test_a_level_that_is_not_there_is_noticed_by_this_test(page: Page, palm: bytes) -> None:
    levels = [lod.mesh for lod in decode_glb(palm)]
    box = window(levels[0])
    page.show("twice", palm, box, None, {})
    with pytest.raises(AssertionError, match="lod0"):
        require_drawn(page, "twice", 0, levels[-1], box)
