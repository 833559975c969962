"""A panorama becomes the six faces of a sky."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.bakers.cubemap import bake_cubemap
from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.cli.table import errors_text
from paradize.data import Texture
from paradize.errors import SceneError, SourceError
from paradize.explain.facts import explain
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.kernels.maps import cut_face
from paradize.metrics.panorama import panorama_errors
from paradize.metrics.texels import decode_texels
from paradize.scene.settings.load import load_scene
from paradize.stages import cubemap
from tests.pipeline.heights import save

F32 = npt.NDArray[np.float32]
ROWS = 32


def exr(path: Path, light: F32) -> Path:
    return save(path, light, oiio.FLOAT)


def panorama(light: Callable[[npt.NDArray[np.float64]], Any], rows: int = ROWS) -> F32:
    """Rows from up to down, columns from south over west, north and east; light: of unit directions."""
    up = np.pi * (0.5 - (np.arange(rows)[:, None] + 0.5) / rows)
    azimuth = np.pi * ((np.arange(2 * rows)[None, :] + 0.5) / rows - 1.0)
    east = np.cos(up) * np.sin(azimuth)
    north = np.cos(up) * np.cos(azimuth)
    return np.asarray(light(np.stack([east, np.sin(up) + 0.0 * azimuth, -north], axis=2)), np.float32)


def faces_of(texture: Texture) -> list[F32]:
    return [decode_texels(texture, 0, face)[:, :, :3] for face in range(texture.faces)]


def direction(face: int, s: float, t: float) -> npt.NDArray[np.float64]:
    """OpenGL 3.3, table 3.18: +X -X +Y -Y +Z -Z, s to the right and t downwards, -1 to 1."""
    rows = [(1, -t, -s), (-1, -t, s), (s, 1, t), (s, -1, -t), (s, -t, 1), (-s, -t, -1)]
    found = np.array(rows[face], np.float64)
    return np.asarray(found / np.sqrt((found * found).sum()))


def test_each_texel_shows_the_light_from_its_direction(tmp_path: Path) -> None:
    path = exr(tmp_path / "sky.exr", panorama(lambda d: 0.5 + 0.5 * d))
    faces = faces_of(decode_ktx2(bake_cubemap([path]).data))
    side = ROWS // 2
    for face, texels in enumerate(faces):
        assert texels.shape == (side, side, 3)
        for y, x in ((0, 0), (0, side - 1), (side // 2, side // 2), (side - 1, 3), (side - 1, side - 1)):
            to = direction(face, (2 * x + 1) / side - 1, (2 * y + 1) / side - 1)
            assert np.abs(2 * texels[y, x] - 1 - to).max() < 0.005, (face, y, x)


def test_light_is_kept_over_the_seam_and_the_poles(tmp_path: Path) -> None:
    """All light together, by solid angle, is that of the panorama, wherever its bright texel lies."""
    count = 64
    for place in ((0, 0), (count // 2, 0), (count // 2, 2 * count - 1), (count - 1, 5), (20, 40)):
        light = np.full((count, 2 * count, 3), 0.25, np.float32)
        light[place] = 100.0
        rows = np.pi * np.arange(count + 1) / count
        cap = (np.cos(rows[:-1]) - np.cos(rows[1:]))[place[0]] * np.pi / count
        faces = cubemap.cut_faces(light)
        side = faces.shape[1]
        s = (np.arange(side) + 0.5) * (2.0 / side) - 1.0
        angle = (2.0 / side) ** 2 * (1.0 + s[:, None] ** 2 + s[None, :] ** 2) ** -1.5
        found = (faces[..., 0] * angle).sum()
        assert found == pytest.approx(0.25 * 4.0 * np.pi + 99.75 * cap, rel=0.01)


@pytest.mark.parametrize("seed", [0, 1, 3])
def test_large_texels_are_mixed_across_the_poles_and_by_solid_angle(seed: int) -> None:
    """Of 4 rows: 0.013 to 0.019; 0.029 and more without what lies beyond a pole, 0.039 unweighted."""
    light = np.random.default_rng(seed).uniform(0.2, 1.0, (4, 8, 3)).astype(np.float32)
    texture = cubemap.encode_cube(cubemap.cube_mips(cubemap.cut_faces(light)))
    assert panorama_errors(texture, light, encoded=False)["panorama_max_relative"] < 0.022


def test_an_even_light_stays_what_it_is(tmp_path: Path) -> None:
    made = bake_cubemap([exr(tmp_path / "sky.exr", np.full((ROWS, 2 * ROWS, 3), 0.75, np.float32))])
    assert all((face == 0.75).all() for face in faces_of(decode_ktx2(made.data)))
    assert max(made.errors.values()) < 1e-6


def test_the_error_is_that_of_the_light_of_sampled_texels(tmp_path: Path) -> None:
    side = 8
    light = panorama(lambda d: 0.5 + 0.4 * d, 2 * side)
    path = exr(tmp_path / "sky.exr", light)
    made = bake_cubemap([path])
    assert 0.0 < made.errors["panorama_p99_relative"] <= made.errors["panorama_max_relative"] < 0.002
    texture = decode_ktx2(made.data)
    half = np.frombuffer(texture.levels[0], np.float16).reshape(6, side, side, 4)

    def error(shown: npt.NDArray[np.float16]) -> float:
        wrong = replace(texture, levels=(shown.tobytes(), *texture.levels[1:]))
        return panorama_errors(wrong, light, encoded=False)["panorama_max_relative"]

    assert error(half) == made.errors["panorama_max_relative"]
    assert error(half * np.float16(1.1)) == pytest.approx(0.1, abs=0.003)
    assert error(half[[1, 0, 2, 3, 4, 5]]) > 0.3  # two faces changed places
    assert error(half[:, :, ::-1]) > 0.3  # mirrored
    assert error(half[:, ::-1]) > 0.3  # upside down


def test_a_panorama_of_8_bits_is_linearised(tmp_path: Path) -> None:
    path = save(tmp_path / "sky.png", np.full((8, 16, 3), 188, np.uint8), oiio.UINT8)
    made = bake_cubemap([path])
    (first, *_) = faces_of(decode_ktx2(made.data))
    assert first.shape == (4, 4, 3) and np.abs(first - 0.5029).max() < 0.001
    assert any("8 bits per channel" in warning for warning in made.warnings)


@pytest.mark.parametrize(("columns", "side"), [(4, 1), (8, 2), (20, 4), (24, 8), (4096, 1024), (8192, 2048)])
def test_faces_have_about_the_texels_of_the_panorama(columns: int, side: int) -> None:
    assert cubemap.face_size(columns) == side


def test_a_face_is_the_same_with_any_number_of_threads() -> None:
    light = np.random.default_rng(1).uniform(0.0, 9.0, (16, 32, 3)).astype(np.float32)
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]])
    one, many = (cut_face(light, axes, size=8, spots=4, threads=threads) for threads in (1, 3))
    assert (one == many).all()
    for wrong in (light[:, :31], light[:0], light[:, :, :2]):
        with pytest.raises(ValueError):
            cut_face(wrong, axes, size=8, spots=4)
    with pytest.raises(ValueError, match="not finite"):
        cut_face(light, axes * np.nan, size=8, spots=4)


def test_what_is_neither_six_faces_nor_a_panorama_is_refused(tmp_path: Path) -> None:
    square = exr(tmp_path / "square.exr", np.zeros((8, 8, 3), np.float32))
    with pytest.raises(SourceError, match="8 x 8 texels; a panorama of all directions is twice") as told:
        bake_cubemap([square])
    assert "resize it to 8 x 4; else write the six faces" in str(told.value)
    bake_cubemap([square] * 6)
    whole = exr(tmp_path / "panorama.exr", np.zeros((4, 8, 3), np.float32))
    with pytest.raises(SourceError, match="8 x 4 texels; the faces of a cube map are square") as told:
        bake_cubemap([square, *[whole] * 5])
    assert 'of a panorama write faces = ["panorama.exr"]' in str(told.value)
    bake_cubemap([whole])
    with pytest.raises(SourceError, match="six faces, or one panorama, not 2"):
        bake_cubemap([square] * 2)


SCENE = """
[scene]
name = "pano"
[sky]
faces = FACES
[flight]
duration_s = 8.0
eye = [{ position = [0, 2, 0] }, { position = [1, 2, 0] }, { position = [1, 2, 1] }]
target = [{ position = [9, 2, 0] }, { position = [9, 2, 9] }, { position = [0, 2, 9] }]
"""


def test_a_scene_takes_a_panorama_for_its_sky(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    exr(tmp_path / "sky.exr", panorama(lambda d: 0.5 + 0.5 * d))
    scene = tmp_path / "pano.toml"
    scene.write_text(SCENE.replace("FACES", '["sky.exr"]'))
    assert not bake(scene, tmp_path / "out", BuildOptions(jobs=1)).errors
    sky = json.loads((tmp_path / "out/scene.json").read_text())["artifacts"]["sky"]
    assert sky["kind"] == "cubemap" and sky["errors"]["panorama_p99_relative"] < 0.002
    (told,) = explain(scene, "sky", tmp_path / "out").artifacts
    bound = told["bound"]
    assert bound["value"] is None and "panorama" in bound["open"][0]
    said = errors_text(sky["errors"], {})
    assert re.search(r"panorama_p99_relative [0-9.e-]+ of the texel's light$", said)
    for count in (2, 5, 7):
        scene.write_text(SCENE.replace("FACES", json.dumps(["sky.exr"] * count)))
        with pytest.raises(SceneError, match="write 1 or 6 files"):
            load_scene(scene)
