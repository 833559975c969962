"""Models look as they do in three.js: one model that the tests make here, those of others on contact sheets.

The sheets are left for a person in build/sheets.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from paradize.formats.png import encode_png
from tests.e2e.browser import find_browser
from tests.e2e.sheets import Shown, draw_sheets, models_below, show_all, summary, without_model
from tests.places import ROOT

FOLDERS = ("gltf", "obj-materials", "obj-kits", "obj-nasty", "obj-large")
BROKEN = ("invalid", "Mesh_PrimitiveRestart", "Mesh_NoPosition")

pytestmark = pytest.mark.skipif(
    find_browser() is None,
    reason="no chromium that is not a snap: Debian's package brings it, Ubuntu has none",
)


def write_box(folder: Path, colors: NDArray[np.uint8]) -> Path:
    """A box with a picture on five sides; the sixth, of a material of another file, has its own colour and
    names normals that there are not."""
    folder.mkdir()
    (folder / "checker.png").write_bytes(encode_png(colors))
    (folder / "box.mtl").write_text("newmtl picture\nmap_Kd checker.png\n")
    (folder / "plain.mtl").write_text("newmtl plain\nKd 0.7 0.2 0.1\n")
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    lines = ["mtllib box.mtl", "mtllib plain.mtl", *(f"v {x} {y} {z}" for x, y, z in corners)]
    lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
    for material, faces in (
        ("picture", [(1, 2, 4, 3), (3, 4, 8, 7), (1, 5, 6, 2), (2, 6, 8, 4), (1, 3, 7, 5)]),
        ("plain", [(5, 7, 8, 6)]),
    ):
        lines.append(f"usemtl {material}")
        normal = "/1" if material == "plain" else ""
        lines += ["f " + " ".join(f"{v}/{t}{normal}" for t, v in enumerate(face, 1)) for face in faces]
    (folder / "box.obj").write_text("\n".join(lines) + "\n")
    return folder / "box.obj"


@pytest.mark.deep
def test_a_model_with_two_materials_looks_as_in_three_js(tmp_path: Path) -> None:
    blocks = np.random.default_rng(5).integers(40, 216, (8, 8, 3), dtype=np.uint8)
    box = write_box(tmp_path / "box", np.kron(blocks, np.ones((16, 16, 1), np.uint8)))
    (row,) = show_all([box], tmp_path, tmp_path / "out", 256)
    assert row.refused == row.three == ""
    assert row.flip is not None and row.flip < 0.04, row
    before = (tmp_path / "out/results.json").stat().st_mtime_ns
    assert show_all([box], tmp_path, tmp_path / "out", 256) == [row]  # nothing is drawn again
    assert (tmp_path / "out/results.json").stat().st_mtime_ns == before


def test_what_a_corpus_calls_broken_or_without_a_face_is_not_counted() -> None:
    rows = """
    | path | source | licence | bytes | sha256 | scan |
    | a/points.obj | x/y | MIT | 9 | 12ab | v=3 f=0; points |
    | a/lines.gltf | x/y | MIT | 1 nodes, 1 meshes, 0 tris, 0 materials |
    | a/flat.obj | x/y | MIT | 9 | 12ab | v=3 f=2; degenerate faces(2) |
    | a/sliver.obj | x/y | MIT | 9 | 12ab | v=9 f=4; degenerate faces(2) |
    | a/nan.obj | x/y | MIT | 9 | 12ab | v=3 f=1; NaN/Inf/short/garbage numbers; no vt |
    | a/index.obj | x/y | MIT | 9 | 12ab | v=3 f=1; out-of-range/zero index |
    | a/whole.glb | x/y | MIT | 1 nodes, 1 meshes, 12 tris, 1 materials |
    | a/box.mtl | x/y | MIT | 9 | 12ab | MTL |
    """
    assert without_model(rows) == {
        "a/points.obj": "no face",
        "a/lines.gltf": "no face",
        "a/flat.obj": "no face with an area",
        "a/nan.obj": "NaN/Inf/short/garbage numbers",
        "a/index.obj": "out-of-range/zero index",
    }


@pytest.mark.deep
def test_models_of_others_are_drawn_and_look_as_in_three_js(corpus: Path) -> None:
    """Of the valid models 95 % bake. Broken glTF files are in folders of their own: gltf/invalid, and two
    that their project calls so. Of others the corpus' own MANIFEST.md says that they hold no valid model."""
    models = models_below((corpus / name for name in FOLDERS), BROKEN)
    out = ROOT / "build/sheets"
    rows: list[Shown] = show_all(models, corpus, out, 256, redo=0.0)
    draw_sheets(rows, out, 256)
    print(summary(rows))
    drawn = [row for row in rows if not row.refused]
    manifest = corpus / "MANIFEST.md"
    invalid = without_model(manifest.read_text(encoding="utf-8")) if manifest.is_file() else {}
    refused = {row.path: row.refused for row in rows if row.refused}
    print(
        *(f"not counted: {path}: {invalid[path]}: {refused[path]}" for path in refused.keys() & invalid),
        sep="\n",
    )
    counted = [row for row in rows if not (row.refused and row.path in invalid)]
    assert len(drawn) >= 0.95 * len(counted), [str(row) for row in counted if row.refused]
    assert all("error: " in row.refused for row in rows if row.refused)
    known = sorted(row.flip for row in drawn if row.flip is not None and not row.lacks)
    assert known[len(known) // 2] < 0.05 and known[int(0.9 * len(known))] < 0.12, known
