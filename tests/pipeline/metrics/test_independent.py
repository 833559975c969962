"""The stated errors of artifacts, measured again by others' programs: trimesh reads and measures meshes,
Pillow reads pictures and decodes blocks, numpy and scipy work in float64. None of it is used by a bake."""

from __future__ import annotations

import io
import json
import math
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image as Pillow
from scipy.spatial import cKDTree

from paradize.bakers.color import bake_color
from paradize.bakers.maps.bake import bake_maps
from paradize.bakers.mesh.bake import bake_mesh
from tests.pipeline import map_truth as truth
from tests.sweeps import sample

if TYPE_CHECKING:
    import trimesh  # half a second: only where it is used

SAMPLES = 3000  # on each surface, besides all vertices


# Meshes


def levels_of(data: bytes) -> list[trimesh.Trimesh]:
    """The levels of a GLB, finest first, their parts joined, as trimesh reads them."""
    import trimesh

    scene = trimesh.load(io.BytesIO(data), file_type="glb", process=False)
    parts: dict[int, list[trimesh.Trimesh]] = {}
    for name, part in scene.geometry.items():
        parts.setdefault(int(name.removeprefix("lod").split("_")[0]), []).append(part)
    return [trimesh.util.concatenate(parts[level]) for level in sorted(parts)]


def nearest(points: np.ndarray, mesh: trimesh.Trimesh) -> np.ndarray:
    """The distance of each point to the surface: every triangle that could be nearest is tried."""
    import trimesh

    triangles = mesh.triangles
    centres = triangles.mean(axis=1)
    radius = np.linalg.norm(triangles - centres[:, None], axis=2).max(axis=1)
    bound = cKDTree(mesh.vertices).query(points)[0]
    out = bound.copy()
    order = np.argsort(radius)
    # Large triangles reach far: those of like size are looked for together.
    for some in np.array_split(order, min(len(order), 12)):
        near = cKDTree(centres[some]).query_ball_point(points, out + radius[some].max())
        count = [len(found) for found in near]
        if not sum(count):
            continue
        at = np.repeat(np.arange(len(points)), count)
        which = some[np.concatenate([np.array(found, int) for found in near if found])]
        on = trimesh.triangles.closest_point(triangles[which], points[at])
        np.minimum.at(out, at, np.linalg.norm(on - points[at], axis=1))
    return out


def measured(a: trimesh.Trimesh, b: trimesh.Trimesh, samples: int = SAMPLES) -> tuple[float, float]:
    """(largest, larger RMS) distance of both ways, of a's diagonal."""
    import trimesh

    largest, rms = 0.0, 0.0
    for one, other in ((a, b), (b, a)):
        points = np.asarray(trimesh.sample.sample_surface(one, samples, seed=1)[0])
        found = nearest(points, other)
        rms = max(rms, math.sqrt(float((found * found).mean())))
        largest = max(largest, found.max(), nearest(np.unique(one.vertices, axis=0), other).max())
    across = float(np.linalg.norm(np.ptp(a.vertices, axis=0)))
    return largest / across, rms / across


def holds(stated: dict[str, Any], found: tuple[float, float]) -> None:
    """No sample lies beyond the stated bound, nor are all far from it; the RMS is the same within 3000
    samples' error."""
    largest, rms = found
    assert largest <= stated["error_max"] * (1 + 1e-6) + 1e-7
    assert largest >= 0.7 * stated["error_max_lower"] - 1e-6
    assert rms == pytest.approx(stated["error_rms"], rel=0.2, abs=2e-6)


# The flight draws two levels of the palm. Few samples of the slab lie where its error is largest.
ISLAND = [("tall_mesh", 3, SAMPLES), ("palm_mesh", 2, SAMPLES), ("slab_mesh", 3, 12 * SAMPLES)]


@pytest.mark.deep
@pytest.mark.parametrize(("name", "least", "samples"), ISLAND)
def test_the_islands_levels_are_as_near_as_they_say_by_trimesh(
    island: Path, name: str, least: int, samples: int
) -> None:
    scene = json.loads((island / "scene.json").read_text())
    data = (island / scene["artifacts"][name]["file"]).read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    stated = [node["extras"] for node in json.loads(data[20 : 20 + length])["nodes"]]
    levels = levels_of(data)
    assert len(levels) == len(stated) >= least
    for level, errors in zip(levels[1:], stated[1:], strict=True):
        holds(errors, measured(levels[0], level, samples))


OTHERS = ("kaykit-medieval-hexagon", "kenney-hexagon-kit", "kenney-watercraft", "quaternius")


@pytest.mark.parametrize(
    "kit", sample(["made/obj-kits/made", *(f"corpus/obj-kits/{name}" for name in OTHERS)], every=9)
)
def test_levels_of_kits_are_as_near_as_they_say_by_trimesh(source: Callable[[str], Path], kit: str) -> None:
    path = sorted(source(kit).rglob("*.obj"), key=lambda p: (p.stat().st_size, p.name))[-3]
    made = bake_mesh(path, lods=3)
    levels = levels_of(made.glb)
    assert len(levels) == len(made.report["lods"])
    for level, errors in zip(levels[1:], made.report["lods"][1:], strict=True):
        holds(errors, measured(levels[0], level))


HAUSDORFF = """
import sys, numpy, pymeshlab
a, b, c, d = (numpy.load(path) for path in sys.argv[1:])
both = pymeshlab.MeshSet()
both.add_mesh(pymeshlab.Mesh(a.astype(float), b.astype("int32")))
both.add_mesh(pymeshlab.Mesh(c.astype(float), d.astype("int32")))
def distance(key, **how):
    pairs = ({"sampledmesh": i, "targetmesh": 1 - i, "samplenum": 20000} for i in (0, 1))
    return max(both.get_hausdorff_distance(**pair, **how)[key] for pair in pairs)
print(distance("max"), distance("RMS", samplevert=False, sampleedge=False, sampleface=True))
"""


@pytest.mark.deep
def test_the_palms_levels_are_as_near_as_they_say_by_meshlab(island: Path, tmp_path: Path) -> None:
    """In a process of its own: it brings libraries that others cannot share."""
    there = subprocess.run([sys.executable, "-c", "import pymeshlab"], capture_output=True, check=False)
    if there.returncode:
        pytest.skip("no pymeshlab: `make bench` installs it")
    scene = json.loads((island / "scene.json").read_text())
    data = (island / scene["artifacts"]["palm_mesh"]["file"]).read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    stated = json.loads(data[20 : 20 + length])["nodes"]
    levels = levels_of(data)
    across = float(np.linalg.norm(np.ptp(levels[0].vertices, axis=0)))
    for node, level in zip(stated[1:], levels[1:], strict=True):
        paths = []
        for k, array in enumerate((levels[0].vertices, levels[0].faces, level.vertices, level.faces)):
            paths.append(tmp_path / f"{k}.npy")
            np.save(paths[-1], np.asarray(array))
        result = subprocess.run(
            [sys.executable, "-c", HAUSDORFF, *map(str, paths)], capture_output=True, text=True, check=True
        )
        largest, rms = (float(word) / across for word in result.stdout.split()[-2:])
        holds(node["extras"], (largest, rms))


# Maps


def raw_levels(ktx2: bytes) -> list[bytes]:
    """The bytes of each level of a KTX2 file without supercompression, by its level index."""
    assert ktx2[:12] == b"\xabKTX 20\xbb\r\n\x1a\n"
    count, scheme = struct.unpack_from("<II", ktx2, 40)
    assert scheme == 0
    index = [struct.unpack_from("<QQQ", ktx2, 80 + 24 * k) for k in range(count)]
    return [ktx2[offset : offset + length] for offset, length, _ in index]


def by_pillow(blocks: bytes, width: int, height: int, dxgi: int) -> np.ndarray:
    """Texels (h, w, channels) of BC blocks, in 0 to 1, decoded by Pillow from a DDS file about them."""
    head = struct.pack("<4s7I44x", b"DDS ", 124, 0x1007, height, width, len(blocks), 0, 1)
    head += struct.pack("<2I4s5I", 32, 4, b"DX10", 0, 0, 0, 0, 0)
    head += struct.pack("<5I", 0x1000, 0, 0, 0, 0) + struct.pack("<5I", dxgi, 3, 0, 1, 0)
    picture = Pillow.open(io.BytesIO(head + blocks))
    return np.asarray(picture, np.float64) / 255.0


def bc5_signed(data: bytes, width: int, height: int) -> np.ndarray:
    """x and y (h, w, 2) of BC5_SNORM blocks, one by one, as Khronos' Data Format Specification says."""
    out = np.zeros((-(-height // 4) * 4, -(-width // 4) * 4, 2))
    for number in range(len(data) // 16):
        row, column = divmod(number, -(-width // 4))
        for channel in range(2):
            block = data[16 * number + 8 * channel :][:8]
            a, b = (max(-127, code) / 127 for code in struct.unpack("<2b", block[:2]))
            if a > b:
                palette = [a, b, *(((7 - k) * a + k * b) / 7 for k in range(1, 7))]
            else:
                palette = [a, b, *(((5 - k) * a + k * b) / 5 for k in range(1, 5)), -1.0, 1.0]
            bits = int.from_bytes(block[2:], "little")
            values = [palette[bits >> 3 * k & 7] for k in range(16)]
            out[4 * row : 4 * row + 4, 4 * column : 4 * column + 4, channel] = np.reshape(values, (4, 4))
    return out[:height, :width]


@pytest.mark.parametrize(("tier", "dxgi"), [("balanced", 71), ("exact", 98)])
@pytest.mark.parametrize(
    "name",
    sample(
        [
            "made/textures/photo.png",
            "made/textures/beach.jpg",
            "corpus/textures/gras_02.png",
            "corpus/textures/leaf.png",
        ],
        every=2,
    ),
)
def test_the_noise_of_colours_is_what_they_say_by_pillow(
    source: Callable[[str], Path], tmp_path: Path, name: str, tier: str, dxgi: int
) -> None:
    """Of every level that Pillow decodes: 8 bits of the decoder's rounding apart."""
    with Pillow.open(source(name)) as picture:
        side = 256
        path = tmp_path / "a.png"
        picture.convert("RGB").crop((0, 0, side, side)).save(path)
    made = bake_color(path, tier=tier)
    codes = np.asarray(Pillow.open(path), np.float64) / 255.0
    light = truth.decode_srgb(codes)
    for level, (data, stated) in enumerate(zip(raw_levels(made.data), made.levels, strict=True)):
        if side >> level < 8:
            break
        found = by_pillow(data, side >> level, side >> level, dxgi)[:, :, :3]
        off = found - truth.encode_srgb(truth.mean(light, level))
        psnr = -10 * np.log10((off * off).mean())
        assert stated["psnr_db"] == pytest.approx(psnr, abs=0.15), level
        assert stated["max"] == pytest.approx(np.abs(off).max(), abs=1.01 / 255), level


EIGHTH = ((4 / 5, -1 / 5, 4 / 105, -1 / 280), (1.0,))  # the slopes of the metric's truth


@pytest.mark.parametrize("name", ["made/height/hills_16.png", "corpus/height/rgbify_elev_512_16.png",
                                  "corpus/height/fuji_512_16.png"])  # fmt: skip
def test_angles_of_normals_are_what_they_say_by_numpy(
    source: Callable[[str], Path], tmp_path: Path, name: str
) -> None:
    """Blocks and their levels, from floats: of codes half a step is not an error (map_truth.py has that)."""
    side = 128
    with Pillow.open(source(name)) as picture:
        heights = np.asarray(picture, np.float32)[:side, :side] / np.float32(65535)
    path = tmp_path / "height.tif"
    Pillow.fromarray(heights).save(path)
    made = bake_maps(
        path,
        only=["normal"],
        source="height",
        wrap="repeat",
        filter="fourth",
        slope_scale=(20.0, 30.0),
    )["normal"]
    assert made.format == "BC5_SNORM"
    normals = truth.normals(heights, EIGHTH, scale=(20.0, 30.0), wrap=(True, True))
    for level, (data, stated) in enumerate(zip(raw_levels(made.data), made.levels, strict=True)):
        xy = bc5_signed(data, max(1, side >> level), max(1, side >> level))
        z = np.sqrt(np.maximum(0.0, 1.0 - (xy * xy).sum(axis=2)))
        found = np.dstack([xy, z]) / np.linalg.norm(np.dstack([xy, z]), axis=2, keepdims=True)
        exact = truth.normalised(truth.mean(normals, level))
        away = np.degrees(
            np.arctan2(np.linalg.norm(np.cross(found, exact), axis=2), (found * exact).sum(axis=2))
        )
        assert stated["mean_deg"] == pytest.approx(away.mean(), rel=1e-3, abs=1e-4), level
        assert stated["p99_deg"] == pytest.approx(truth.p99(away), rel=1e-3, abs=1e-4), level
        assert stated["max_deg"] == pytest.approx(away.max(), rel=1e-3, abs=1e-4), level


@pytest.mark.deep
def test_the_islands_sand_is_as_noisy_as_it_says_by_pillow(island: Path, root: Path) -> None:
    entry = json.loads((island / "scene.json").read_text())["artifacts"]["sand_color"]
    rows = 512  # of each level's size, from its top: enough to tell
    with Pillow.open(root / "raw_assets/terrain/sand.png") as picture:
        width = picture.width
        codes = np.asarray(picture.convert("RGB").crop((0, 0, width, rows)), np.float64) / 255.0
    data = raw_levels((island / entry["file"]).read_bytes())
    light = truth.decode_srgb(codes)
    for level in (0, 1):
        down, across = rows >> level, width >> level
        found = by_pillow(data[level][: down * across // 2], across, down, 71)[:, :, :3]
        mean = light.reshape(down, 1 << level, across, 1 << level, 3).mean(axis=(1, 3))
        off = found - truth.encode_srgb(mean)
        psnr = -10 * np.log10((off * off).mean())
        assert entry["levels"][level]["psnr_db"] == pytest.approx(psnr, abs=0.5)  # of a part of it
