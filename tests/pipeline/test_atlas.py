"""The atlas: inside the square, nothing over anything else, and an error instead of a hang."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from paradize.bake_mesh import bake_mesh
from paradize.engine.isolate import call_isolated
from paradize.errors import BakeError, SourceError
from paradize.formats.glb import decode_glb
from paradize.stages.atlas import make_atlas, overlap
from paradize.stages.normals import complete_normals
from tests.pipeline.shapes import cube, sphere


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e9])
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_any_size_and_place_gets_an_atlas_without_overlap(scale: float, offset: float) -> None:
    mesh = replace(sphere(6), uvs=None)
    moved = replace(mesh, positions=((mesh.positions + np.float32(offset)) * np.float32(scale)))
    done = make_atlas(moved)
    assert done.uvs is not None
    assert done.uvs.min() >= 0 and done.uvs.max() <= 1 and np.isfinite(done.uvs).all()
    assert np.array_equal(done.positions[done.triangles], moved.positions[moved.triangles])
    covered, twice = overlap(done.uvs[done.triangles])
    assert covered > 0.2 * 512 * 512 and twice <= 0.002 * covered


def test_no_chart_is_mirrored() -> None:
    done = make_atlas(complete_normals(cube())[0])
    assert done.uvs is not None
    uv = done.uvs[done.triangles].astype(float)
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    turned = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    assert (turned < 0).all() or (turned > 0).all()


def test_overlap_is_seen() -> None:
    whole = np.array([[[0, 0], [1, 0], [0, 1]]], np.float32)
    covered, twice = overlap(whole)
    assert abs(covered - 512 * 512 / 2) < 600 and twice == 0
    assert overlap(np.concatenate([whole, whole]))[1] == covered
    halves = np.concatenate([whole, 1 - whole])
    assert overlap(halves)[1] == 0


def test_a_bake_with_an_atlas_has_tangent_frames(tmp_path: Path) -> None:
    path = tmp_path / "cube.obj"
    rows = [f"v {x} {y} {z}" for x, y, z in cube().positions.tolist()]
    path.write_text("\n".join(rows + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in cube().triangles.tolist()]))
    plain = bake_mesh(path, lods=1)
    assert decode_glb(plain.glb)[0].mesh.tangents is None
    assert any("--atlas" in warning for warning in plain.report["warnings"])
    mesh = decode_glb(bake_mesh(path, lods=1, atlas=True).glb)[0].mesh
    assert mesh.tangents is not None and mesh.uvs is not None
    assert overlap(mesh.uvs[mesh.triangles])[1] == 0


@pytest.mark.parametrize("setting", [{"resolution": 32}, {"padding": 1000}])
def test_settings_that_hang_xatlas_are_refused(setting: dict[str, int]) -> None:
    with pytest.raises(BakeError, match="expected 64 to 8192"):
        make_atlas(sphere(3), **setting)


def hang() -> None:
    time.sleep(60)


def crash() -> None:
    os.abort()


def fill() -> int:
    return len(np.zeros(1 << 34, np.uint8))


def refuse() -> None:
    raise SourceError("is not a mesh", file="a.obj")


def test_a_hang_a_crash_and_a_memory_hog_become_errors_that_name_the_input() -> None:
    with pytest.raises(BakeError, match=r"a\.obj took longer than 0.5 s"):
        call_isolated("the atlas of a.obj", hang, {}, timeout_s=0.5)
    with pytest.raises(BakeError, match=r"a\.obj.*SIGABRT"):
        call_isolated("the atlas of a.obj", crash, {}, timeout_s=30)
    with pytest.raises(SourceError, match="memory"):
        call_isolated("the atlas of a.obj", fill, {}, timeout_s=30, memory_bytes=4 << 30)
    with pytest.raises(SourceError, match=r"a\.obj: is not a mesh"):
        call_isolated("the atlas of a.obj", refuse, {}, timeout_s=30)
