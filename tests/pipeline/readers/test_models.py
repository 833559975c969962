"""Models of every kind, made here and of others: each is baked, or refused with a clear message; none is a
crash or a hang."""

from __future__ import annotations

import json
import resource
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from paradize.bakers.mesh.bake import bake_mesh
from paradize.errors import ParadizeError, SourceError
from paradize.formats.glb.reader import decode_glb
from paradize.readers.heightmap import read_heightmap
from paradize.readers.model import read_model
from paradize.readers.obj import read_obj
from tests.pipeline.readers.gltf.made import Made, shown
from tests.pipeline.readers.test_ply import columns, ply
from tests.sweeps import CORPUS_DEEP

FOLDERS = ("obj-kits", "obj-nasty", "obj-large", "tangent", "malformed/obj-afl")


def models(sources: Path, folders: tuple[str, ...]) -> list[Path]:
    found = [path for folder in folders for path in sorted((sources / folder).rglob("*")) if path.is_file()]
    return [path for path in found if path.suffix.lower() == ".obj" or path.parent.name == "obj-afl"]


def triangles_by_text(path: Path) -> int:
    """Corners minus two of every face statement, counted without the reader."""
    text = path.read_bytes().decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    rows = (line.split("#")[0].split() for line in text.replace("\\\n", " ").split("\n"))
    return sum(max(0, len(row) - 3) for row in rows if row and row[0] == "f")


def bake_or_refuse(path: Path) -> bool:
    """Bakes one file and looks at the result; False where it was refused."""
    try:
        made = bake_mesh(path)
    except ParadizeError as error:
        assert str(path) in str(error) and len(str(error)) > len(str(path)) + 5
        assert "Error(" not in str(error) and "Traceback" not in str(error)
        return False
    levels = decode_glb(made.glb)
    counts = [len(level.mesh.triangles) for level in levels]
    assert counts == sorted(counts, reverse=True)
    mended = made.report["repairs"]
    dropped = mended["degenerate"]["count"] + mended["doubled"]["count"]
    assert counts[0] + dropped == triangles_by_text(path)
    assert dropped == 0 or any("dropped" in warning for warning in made.report["warnings"])
    for level in levels:
        assert level.mesh.normals is not None
        assert np.abs(np.linalg.norm(level.mesh.normals, axis=1) - 1).max() < 1e-5
        assert (level.mesh.tangents is None) == (level.mesh.uvs is None)
    return True


def few(paths: list[Path]) -> list[Path]:
    """Ten to twenty of them, spread evenly."""
    return paths[:: max(1, len(paths) // 10)]


@CORPUS_DEEP
def test_every_face_of_every_file_is_read(sources: Path) -> None:
    read, paths = 0, models(sources, FOLDERS)
    for path in paths:
        try:
            found = read_obj(path).counts["triangles"]
        except ParadizeError:
            continue
        assert found == triangles_by_text(path), path
        read += 1
    assert read > len(paths) // 3


@CORPUS_DEEP
def test_a_sample_of_every_folder_is_baked_or_refused(sources: Path) -> None:
    chosen = [path for folder in FOLDERS for path in few(models(sources, (folder,)))]
    baked = sum(bake_or_refuse(path) for path in chosen if path.stat().st_size < 500_000)
    assert baked > 10


def limited() -> None:
    """Limits a child process: 4 GiB of memory and a minute of a processor, however busy that is."""
    resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))


@pytest.mark.deep
def test_the_command_bakes_or_refuses_every_model_in_time_and_memory(
    sources: Path, tmp_path: Path, root: Path
) -> None:
    program, out = root / "build/venv/bin/paradize", tmp_path / "out.glb"
    for path in models(sources, FOLDERS):
        command = [program, "mesh", path, "-o", out, "--json"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=900, preexec_fn=limited)
        assert done.returncode in (0, 1) and "Traceback" not in done.stderr, path
        if done.returncode:
            assert not out.exists() and path.name in done.stderr, path
            assert json.loads(done.stdout)["error"], path
            continue
        report = json.loads(done.stdout)
        dropped = sum(report["repairs"][what]["count"] for what in ("degenerate", "doubled"))
        assert report["triangles"] + dropped == triangles_by_text(path), path
        decode_glb(out.read_bytes())
        out.unlink()


@pytest.mark.deep
@CORPUS_DEEP
def test_every_kit_model_is_baked(sources: Path) -> None:
    """Sound models: no refusal is right."""
    for path in few(models(sources, ("obj-kits",))):
        assert bake_or_refuse(path), path


def test_texture_coordinates_that_no_player_takes_are_told_and_left_out(tmp_path: Path) -> None:
    """The player refused the baked mesh."""
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5 0\nvt 1e30 0\nvt 0 1e7\nf 1/1 2/2 3/3\n")
    made = read_model(path)
    assert made.mesh.uvs is not None
    assert sorted(made.mesh.uvs.tolist()) == [[0.0, -1e7 + 1], [0.0, 0.0], [0.5, 1.0]]
    said = "texture coordinates of 1 vertex lie farther than 1e+07 tiles from 0 (first: 1e+30 1)"
    assert made.warnings == [f"{path}: {said}; read as (0, 0): unwrap the model again"]


def test_a_signalling_nan_is_refused_or_told_like_any_other(tmp_path: Path) -> None:
    """numpy warned of it, in lines of its own code before the message."""
    bad = np.array([[0, 0, 0], [1, 7, 0], [0, 1, 0]], np.float32)
    text = ply("binary_little_endian", columns("float", "x y z", bad), [[0, 1, 2]])
    bad.view(np.uint32)[1, 1] = 0x7FA00000
    (tmp_path / "a.ply").write_bytes(text.replace(np.float32(7).tobytes(), bad[1, 1:2].tobytes()))
    facet = struct.pack("<I", 1) + bytes(12) + bad.tobytes() + bytes(2)
    (tmp_path / "a.stl").write_bytes(bytes(80) + facet)
    made = Made()
    shown({"attributes": {"POSITION": made.array(bad)}}, made).glb(tmp_path / "a.glb")
    for name in ("a.stl", "a.ply", "a.glb"):
        with pytest.raises(SourceError, match="nan"):
            read_model(tmp_path / name)
    heights = np.ones((32, 32), np.float32)
    heights.view(np.uint32)[3, 4] = 0x7FA00000
    (tmp_path / "a.r32").write_bytes(heights.tobytes())
    field, warnings = read_heightmap(tmp_path / "a.r32", size_x_m=1.0, size_z_m=1.0, height_m=None)
    assert (field.heights_m == 1.0).all() and any("1 pixel" in text for text in warnings), warnings
