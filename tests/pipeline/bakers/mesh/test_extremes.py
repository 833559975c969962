"""Meshes at the ends of what there can be: sizes, counts, surfaces that are none, from OBJ to GLB."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from paradize.bakers.mesh.bake import bake_mesh
from paradize.data import Mesh
from paradize.errors import SourceError
from paradize.formats.glb.reader import decode_glb
from paradize.readers.obj import read_obj
from paradize.stages.normals import complete_normals
from paradize.stages.validate import validate_mesh
from tests.pipeline.glb_json import document
from tests.pipeline.shapes import sphere
from tests.places import PEAK
from tests.sweeps import sample, sweep


def write(path: Path, mesh: Mesh, scale: float = 1.0) -> Path:
    p = mesh.positions.astype(np.float64) * scale
    text = [f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in p.tolist()]
    faces = (mesh.triangles + 1).tolist()
    if mesh.uvs is not None:
        text += [f"vt {u:.9g} {1 - v:.9g}\n" for u, v in mesh.uvs.tolist()]
        text += [f"f {a}/{a} {b}/{b} {c}/{c}\n" for a, b, c in faces]
    else:
        text += [f"f {a} {b} {c}\n" for a, b, c in faces]
    path.write_text("".join(text))
    return path


@pytest.mark.parametrize("radius", sample([1e-38, 1e-30, 1e30, 1.6e38], every=3))
def test_a_ball_of_any_size_has_the_levels_and_errors_of_one_of_a_metre(
    tmp_path: Path, radius: float
) -> None:
    known = bake_mesh(write(tmp_path / "a.obj", sphere(12)), lods=3).report
    found = bake_mesh(write(tmp_path / "b.obj", sphere(12), radius), lods=3).report
    assert found["closed"] and found["repairs"]["degenerate"]["count"] == 0
    for ours, theirs in zip(found["lods"], known["lods"], strict=True):
        assert ours["triangles"] == pytest.approx(theirs["triangles"], abs=2)
        assert ours["error_rms"] == pytest.approx(theirs["error_rms"], rel=0.02, abs=1e-6)


def test_a_coordinate_near_the_largest_float_is_refused_with_its_limit(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match=r"3\.4e\+38 metres, limit 1\.7e\+38"):
        bake_mesh(write(tmp_path / "a.obj", sphere(8), 3.4e38))


def strip(vertices: int) -> Mesh:
    """A zigzag of `vertices` different vertices, all of them used."""
    i = np.arange(vertices)
    points = np.stack([i // 2, i % 2, np.zeros(vertices)], 1).astype(np.float32)
    faces = np.stack([i[:-2], i[1:-1], i[2:]], 1)
    faces[1::2] = faces[1::2, ::-1]
    return Mesh(points, faces.astype(np.uint32))


@pytest.mark.parametrize("vertices", sweep([65_535, 65_536, 65_537], test=[65_536]))
def test_indices_are_right_about_the_end_of_sixteen_bits(tmp_path: Path, vertices: int) -> None:
    mesh = strip(vertices)
    made = bake_mesh(write(tmp_path / "a.obj", mesh), lods=1)
    level = decode_glb(made.glb)[0].mesh
    assert len(level.positions) == vertices and len(level.triangles) == vertices - 2
    corners = level.positions[level.triangles].reshape(-1, 9)
    wanted = mesh.positions[mesh.triangles].reshape(-1, 9)
    turned = [np.roll(wanted, 3 * k, axis=1) for k in range(3)]
    known = {row for rows in turned for row in rows.view("V36").ravel().tolist()}  # by their bytes
    assert not {*corners.view("V36").ravel().tolist()} - known
    tree = document(made.glb)
    (mesh_part,) = tree["meshes"][0]["primitives"]
    wide = tree["accessors"][mesh_part["indices"]]["componentType"] == 5125
    assert wide == (vertices > 65_535)  # index 65535 of 16 bits restarts primitives


def test_one_triangle_is_a_mesh(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    made = bake_mesh(path)
    assert [level["triangles"] for level in made.report["lods"]] == [1]
    assert made.report["repairs"]["border_edges"]["count"] == 3


@pytest.mark.parametrize(
    ("faces", "said"),
    [("", "no faces"), ("f 1 1 2\nf 1 2 4\nf 3 3 3\n", "all 3 triangles are degenerate")],
)
def test_a_file_without_a_surface_is_refused(tmp_path: Path, faces: str, said: str) -> None:
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\n" + faces)
    with pytest.raises(SourceError, match=said):
        bake_mesh(path)


def test_vertices_that_no_face_names_are_counted_and_told(tmp_path: Path) -> None:
    path = tmp_path / "points.obj"
    path.write_text("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 1 0\nv 0 0 7\nf 2 3 4\n")
    report = bake_mesh(path).report
    assert report["repairs"]["unused_vertices"]["count"] == 3
    assert any("3 vertices without a triangle left out" in text for text in report["warnings"])


def test_two_cubes_that_share_an_edge_are_told_with_its_line(tmp_path: Path) -> None:
    points = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    quads = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]
    text = ""
    for cube in range(2):
        text += "".join(f"v {x + cube} {y + cube} {z}\n" for x, y, z in points)
        text += "".join("f " + " ".join(str(i + 8 * cube) for i in quad) + "\n" for quad in quads)
    path = tmp_path / "a.obj"
    path.write_text(text)
    report = bake_mesh(path, lods=1).report
    result = report["repairs"]["non_manifold_edges"]
    assert result["count"] == 1 and text.splitlines()[result["line"] - 1].startswith("f ")
    assert report["triangles"] == 24 and report["components"] == 1 and not report["closed"]


@pytest.mark.parametrize("count", sweep([50_000, 1_000_000], test=[50_000]))
def test_many_cards_are_read_checked_and_given_normals(count: int) -> None:
    rng = np.random.default_rng(1)
    corner = rng.random((count, 1, 3)).astype(np.float32) * 100
    sides = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]], np.float32)
    points = (corner + sides).reshape(-1, 3)
    quads = np.arange(count * 4, dtype=np.uint32).reshape(-1, 4)
    mesh = Mesh(points, quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))
    sound, report = validate_mesh(mesh)
    assert report.topology.components > 0.99 * count
    normals = complete_normals(sound, crease_deg=45.0)[0].normals
    assert normals is not None and np.isfinite(normals).all()


MEMORY = (
    PEAK
    + """
import sys
from pathlib import Path
from paradize.readers.obj import read_obj
before = peak()
read_obj(Path(sys.argv[1]))
print(peak() - before)
"""
)


def test_reading_takes_no_more_than_ten_times_the_bytes_of_the_file(tmp_path: Path) -> None:
    """Also where every corner is a vertex of its own and where faces are short."""
    quads = "".join(f"v {i % 997} {i % 991} {i}\n" for i in range(80_000))
    quads += "".join(f"f {i} {i + 1} {i + 2} {i + 3}\n" for i in range(1, 80_000 - 4, 4))
    fans = "".join(f"v {i}.5 {i % 7} 0\nvt 0.{i} 1\n" for i in range(40_000))
    fans += "".join(f"f 1/{i} 2/{i + 1} 3/{i + 2}\n" for i in range(1, 39_000))
    for text in (quads, fans, "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "f 1 2 3\n" * 100_000):
        path = tmp_path / "a.obj"
        path.write_text(text)
        done = subprocess.run(
            [sys.executable, "-c", MEMORY, str(path)], capture_output=True, text=True, check=True
        )
        assert int(done.stdout) <= 10 * len(text)


def test_a_long_chain_of_corners_at_one_position_costs_no_square_of_time(tmp_path: Path) -> None:
    count = 200_000
    path = tmp_path / "a.obj"
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "".join(f"vt 0 0.{i}\n" for i in range(count))
    path.write_text(text + "".join(f"f 1/{i} 2/{i} 3/{i}\n" for i in range(1, count + 1)))
    mesh = read_obj(path).mesh
    assert len(mesh.triangles) == count
    assert mesh.uvs is not None
    assert np.array_equal(mesh.uvs[mesh.triangles[:, 0]], mesh.uvs[mesh.triangles[:, 1]])
