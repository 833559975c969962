"""A terrain mesh lies nowhere farther from its heightmap than promised, and covers it exactly once."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paradize.bakers.terrain.mesh import _six, bake_terrain
from paradize.data import Heightfield, Mesh
from paradize.errors import BakeError, SourceError
from paradize.formats.glb.reader import decode_glb
from paradize.kernels.terrain import bisect, refine
from paradize.metrics.terrain import terrain_error
from paradize.readers.heightmap import read_heightmap
from paradize.scene.baker_settings import TerrainSettings
from paradize.stages.terrain import terrain_mesh
from tests.pipeline.height_grids import height_grids
from tests.pipeline.readers.test_height_tile import colors_of
from tests.sweeps import CORPUS_DEEP, sweep, tries

F32 = npt.NDArray[np.float32]


def field_of(heights: npt.ArrayLike, size_x_m: float = 10.0, size_z_m: float = 10.0) -> Heightfield:
    return Heightfield(np.ascontiguousarray(heights, dtype=np.float32), size_x_m, size_z_m)


def hills(rows: int, columns: int, seed: int = 0) -> F32:
    z, x = np.mgrid[0:rows, 0:columns].astype(np.float64)
    rough = np.random.default_rng(seed).normal(size=(rows, columns))
    return (3.0 * np.sin(x / 9.0) * np.cos(z / 7.0) + 0.05 * rough).astype(np.float32)


def write(path: Path, pixels: npt.NDArray[np.generic]) -> Path:
    if pixels.ndim == 2:
        pixels = pixels[:, :, None]
    kind = {np.dtype(np.uint8): "uint8", np.dtype(np.uint16): "uint16", np.dtype(np.float32): "float"}
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind[pixels.dtype])
    out = oiio.ImageOutput.create(str(path))
    assert out and out.open(str(path), spec) and out.write_image(np.ascontiguousarray(pixels))
    out.close()
    return path


def area_covered(mesh: Mesh) -> float:
    x, z = (mesh.positions[:, k].astype(np.float64)[mesh.triangles] for k in (0, 2))
    doubled = (x[:, 2] - x[:, 0]) * (z[:, 1] - z[:, 0]) - (x[:, 1] - x[:, 0]) * (z[:, 2] - z[:, 0])
    assert (doubled > 0.0).all(), "a triangle faces down"
    return float(doubled.sum() / 2.0)


def edges_meet(triangles: npt.NDArray[np.uint32]) -> bool:
    """Every directed edge is there once, and its opposite too unless it lies on the rim."""
    starts, ends = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64).T
    edges, opposite = starts << 32 | ends, ends << 32 | starts
    rim = ~np.isin(edges, opposite)
    begins = np.sort(starts[rim])
    once = len(np.unique(edges)) == len(edges) and len(np.unique(begins)) == len(begins)
    return once and np.array_equal(begins, np.sort(ends[rim]))


@given(height_grids(24), st.sampled_from([0.0, 0.01, 0.3, 1.0, 30.0]), st.sampled_from(["fast", "balanced"]))
@settings(max_examples=tries(120), deadline=None)
def test_any_heights_keep_the_bound_and_are_covered_once(heights: F32, tolerance: float, tier: str) -> None:
    field = field_of(heights, 7.0, 13.0)
    mesh = terrain_mesh(field, tolerance_m=tolerance, tier=tier)
    error = terrain_error(mesh, field)
    # A vertex's x and z are float32: a cliff stands as far aside as they round.
    cliff_m = max(np.abs(np.diff(heights, axis=k)).max(initial=0.0) for k in (0, 1))
    step_m = min(7.0 / (heights.shape[1] - 1), 13.0 / (heights.shape[0] - 1))
    rounding_m = 4.0 * float(np.spacing(np.float32(6.5))) * (cliff_m / step_m + 1.0)
    assert error.max_m <= tolerance * (1.0 + 1e-6) + rounding_m
    assert error.holes == 0 and error.flipped == 0
    assert area_covered(mesh) == pytest.approx(7.0 * 13.0, rel=1e-6)
    assert edges_meet(mesh.triangles)
    assert (np.abs(np.sqrt((mesh.normals.astype(np.float64) ** 2).sum(axis=1)) - 1.0) < 1e-6).all()


@pytest.mark.parametrize(
    ("name", "heights", "most"),
    [
        ("constant", np.full((33, 33), 5.0), 2),
        ("plane", np.add.outer(np.arange(17) * 0.5, np.arange(40) * 0.25), 2),
        ("2 x 2", np.array([[0.0, 1.0], [2.0, -1.0]]), 2),
        ("2 x N", np.array([[0.0, 3.0, 0.0, 5.0], [0.0, 0.0, 0.0, 0.0]]), 6),
        ("spike", np.pad([[9.0]], 8), 200),
        ("step", np.repeat([[0.0] * 10 + [4.0] * 10], 20, axis=0), 200),
    ],
)
def test_simple_shapes_need_few_triangles(name: str, heights: npt.ArrayLike, most: int) -> None:
    field = field_of(heights)
    mesh = terrain_mesh(field, tolerance_m=1e-4, tier="balanced")
    assert len(mesh.triangles) <= most, name
    assert terrain_error(mesh, field).max_m <= 1e-4


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_heights_of_any_scale_keep_the_bound(scale: float) -> None:
    field = field_of(hills(40, 40) * np.float32(scale), 1e-3 * scale, 1e3 * scale)
    mesh = terrain_mesh(field, tolerance_m=0.1 * scale, tier="balanced")
    assert terrain_error(mesh, field).max_m <= 0.1 * scale * (1.0 + 1e-5)
    assert np.isfinite(mesh.normals).all() and np.isfinite(mesh.tangents).all()


def test_the_true_error_falls_with_the_asked_error() -> None:
    field = field_of(hills(97, 65))
    counts, errors = [], []
    for bound_m in (2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.0):
        mesh = terrain_mesh(field, tolerance_m=bound_m, tier="balanced")
        counts.append(len(mesh.triangles))
        errors.append(terrain_error(mesh, field).max_m)
    assert errors == sorted(errors, reverse=True) and counts == sorted(counts)
    assert errors[-1] < 1e-5 and counts[-1] == 2 * 96 * 64  # the rounding of positions to float32


def test_the_metric_measures_a_known_error() -> None:
    """Two triangles over a grid whose middle stands 3 m off: the error is 3 m there and the RMS follows."""
    heights = np.zeros((5, 5), np.float32)
    heights[2, 2] = 3.0
    flat = terrain_mesh(field_of(np.zeros((5, 5))), tolerance_m=1.0, tier="balanced")
    error = terrain_error(flat, field_of(heights))
    assert error.max_m == pytest.approx(3.0) and error.worst == (2, 2)
    assert error.rms_m == pytest.approx(3.0 / 5.0)
    oblong = np.zeros((5, 8), np.float32)
    oblong[2, 6] = -1.0
    assert terrain_error(flat, field_of(oblong)).worst == (2, 6)
    tall = np.zeros((130, 5), np.float32)
    tall[100, 3] = 2.0
    assert terrain_error(flat, field_of(tall)).worst == (100, 3)
    lifted = flat.positions + np.float32([0, 2, 0])
    for sheets in ((flat.positions, lifted), (lifted, flat.positions)):  # the worst of all at a pixel counts
        both = Mesh(np.concatenate(sheets), np.concatenate([flat.triangles, flat.triangles + 4]))
        error = terrain_error(both, field_of(heights))
        assert error.max_m == pytest.approx(3.0) and error.worst == (2, 2)
        assert error.rms_m == pytest.approx(np.sqrt((24 * 4 + 9) / 25))
    hole = Mesh(flat.positions, flat.triangles[:1])
    assert terrain_error(hole, field_of(heights)).holes == 10
    assert terrain_error(hole, field_of(heights)).rms_m == pytest.approx(3.0 / np.sqrt(15.0))
    turned = Mesh(flat.positions, np.ascontiguousarray(flat.triangles[:, ::-1]))
    assert terrain_error(turned, field_of(heights)).flipped == 2


@pytest.mark.parametrize("size_m", [0.7, 1.4, 2.8, 10.0])
def test_a_ground_reaches_its_rim_though_float32_rounds_its_vertices_inwards(size_m: float) -> None:
    flat = terrain_mesh(field_of(np.zeros((9, 17)), size_m, size_m), tolerance_m=1.0, tier="balanced")
    assert terrain_error(flat, field_of(np.zeros((9, 17)), size_m, size_m)).holes == 0


def test_pixels_are_vertices_and_row_0_lies_at_minus_z() -> None:
    heights = np.arange(12, dtype=np.float32).reshape(3, 4)
    mesh = terrain_mesh(field_of(heights, 6.0, 4.0), tolerance_m=0.0, sand_repeat=3.0, tier="exact")
    by_height = {float(p[1]): k for k, p in enumerate(mesh.positions)}
    assert mesh.positions[by_height[0.0]].tolist() == [-3.0, 0.0, -2.0]
    assert mesh.positions[by_height[3.0]].tolist() == [3.0, 3.0, -2.0]
    assert mesh.positions[by_height[8.0]].tolist() == [-3.0, 8.0, 2.0]
    assert mesh.uvs1[by_height[0.0]].tolist() == [0.0, 0.0]
    assert mesh.uvs1[by_height[11.0]].tolist() == [1.0, 1.0]
    assert mesh.uvs[by_height[11.0]].tolist() == [3.0, 2.0]  # square tiles: 3 along 6 m, 2 along 4 m


def test_normals_and_tangents_are_those_of_the_height_field() -> None:
    z, x = np.mgrid[0:33, 0:33] / 32.0 * 8.0 - 4.0
    field = field_of(0.1 * x * x + 0.05 * z * z - 0.1 * x * z, 8.0, 8.0)
    mesh = terrain_mesh(field, tolerance_m=0.01, tier="balanced")
    px, pz = mesh.positions[:, 0].astype(np.float64), mesh.positions[:, 2].astype(np.float64)
    inner = (np.abs(px) < 3.9) & (np.abs(pz) < 3.9)
    slope_x, slope_z = 0.2 * px - 0.1 * pz, 0.1 * pz - 0.1 * px
    truth = np.stack([-slope_x, np.ones_like(px), -slope_z], axis=1)
    truth /= np.linalg.norm(truth, axis=1)[:, None]
    assert np.abs(mesh.normals - truth)[inner].max() < 1e-5
    t, n = mesh.tangents[:, :3].astype(np.float64), mesh.normals.astype(np.float64)
    assert np.abs((t * n).sum(axis=1)).max() < 1e-6
    assert (t[:, 0] > 0).all() and (mesh.tangents[:, 3] == 1.0).all()
    assert (np.cross(n, t)[:, 2] < 0).all()  # B points to -Z, up the image


def test_without_a_bound_the_steps_of_an_8_bit_slope_get_no_triangles(tmp_path: Path) -> None:
    z, x = np.mgrid[0:33, 0:33] / 32.0
    half = {"size_m": (40.0, 40.0), "height_m": 100.0, "height_scale": 0.5}
    coarse, fine = (
        write(tmp_path / f"{kind}.png", np.rint((0.3 * x + 0.2 * z) * np.iinfo(kind).max).astype(kind))
        for kind in ("uint8", "uint16")
    )
    made = bake_terrain(coarse, TerrainSettings(**half))
    assert made.triangles == 2 and made.max_error_m <= made.bound_m == pytest.approx(50.0 / 255.0, rel=1e-3)
    assert "steps of 0.196 m" in made.warnings[0]
    named = bake_terrain(coarse, TerrainSettings(**half, max_error_m=0.05))
    assert named.bound_m == 0.05 and named.triangles > 100
    assert bake_terrain(fine, TerrainSettings(**half)).bound_m == 0.05


def test_without_a_bound_heights_in_metres_err_by_at_most_a_thousandth_of_their_relief(
    tmp_path: Path,
) -> None:
    path = write(tmp_path / "metres.exr", np.float32(300.0) + np.float32(80.0) * hills(33, 33))
    field, _ = read_heightmap(path, size_x_m=100, size_z_m=100, height_m=None)
    made = bake_terrain(path, TerrainSettings(size_m=(100.0, 100.0)))
    assert made.max_error_m <= made.bound_m == pytest.approx(np.ptp(field.heights_m) / 1000.0, abs=1e-6)


def test_without_a_bound_a_tile_errs_by_a_thousandth_of_its_relief_or_a_step_of_its_digits(
    tmp_path: Path,
) -> None:
    low = 700.0 + hills(33, 33)
    for heights, bound_m in ((low, 0.1 * 0.5), (100.0 * low, np.ptp(50.0 * low) / 1000.0)):
        path = write(tmp_path / "tile.png", colors_of(heights, "terrain-rgb").astype(np.uint8))
        settings = TerrainSettings(
            size_m=(90.0, 90.0), encoding="terrain-rgb", height_m=900.0, height_scale=0.5
        )
        made = bake_terrain(path, settings)
        assert made.max_error_m <= made.bound_m == pytest.approx(bound_m, rel=2e-3)
        assert ["are metres already" in text for text in made.warnings].count(True) == 1


@pytest.mark.parametrize("tier", ["fast", "balanced", "exact"])
def test_a_planes_normals_are_its_own_up_to_the_rim(tier: str) -> None:
    z, x = np.mgrid[0:9, 0:13] * 1.0
    mesh = terrain_mesh(field_of(0.25 * x - 0.5 * z, 24.0, 4.0), tolerance_m=1e-3, tier=tier)
    normal = np.array([-0.125, 1.0, 1.0]) / np.sqrt(0.125**2 + 2)  # slopes: 0.25 a 2 m, -0.5 a 0.5 m
    assert np.abs(mesh.normals - normal).max() < 1e-6


def test_the_mesh_is_a_delaunay_triangulation() -> None:
    pixels, triangles = refine(hills(40, 30), 0.4)
    points = pixels[:, ::-1].astype(np.int64)
    for a, b, c in points[triangles]:
        d = points
        ax, ay, bx, by, cx, cy = (
            a[0] - d[:, 0], a[1] - d[:, 1], b[0] - d[:, 0], b[1] - d[:, 1], c[0] - d[:, 0], c[1] - d[:, 1]
        )  # fmt: skip
        inside = (
            (ax * ax + ay * ay) * (bx * cy - by * cx)
            - (bx * bx + by * by) * (ax * cy - ay * cx)
            + (cx * cx + cy * cy) * (ax * by - ay * bx)
        )
        assert (inside <= 0).all()


@pytest.mark.parametrize("make", [refine, bisect])
@pytest.mark.parametrize(
    ("rows", "columns"),
    sweep(
        [(2, 2), (2, 9), (9, 2), (33, 20), (257, 258), (300, 700), (513, 513)],
        test=[(2, 2), (9, 2), (33, 20)],
    ),
)
def test_tiles_meet_and_threads_do_not_matter(make, rows: int, columns: int) -> None:  # type: ignore[no-untyped-def]
    """Whole numbers: the doubled areas sum to the rectangle's, every one positive, all edges meet."""
    heights = hills(rows, columns)
    for tolerance in (0.02, 0.4, 5.0):
        pixels, triangles = make(heights, tolerance, threads=1)
        for mine, again in zip((pixels, triangles), make(heights, tolerance, threads=3), strict=True):
            assert np.array_equal(mine, again)
        at = pixels.astype(np.int64)[triangles]
        doubled = (at[:, 1, 1] - at[:, 0, 1]) * (at[:, 2, 0] - at[:, 0, 0]) - (at[:, 1, 0] - at[:, 0, 0]) * (
            at[:, 2, 1] - at[:, 0, 1]
        )
        assert (doubled > 0).all() and int(doubled.sum()) == 2 * (rows - 1) * (columns - 1)
        assert edges_meet(triangles)


def test_a_plane_of_many_tiles_needs_two_triangles() -> None:
    assert len(refine(np.full((700, 1100), 3.0, np.float32), 0.01)[1]) == 2


def test_the_kernel_refuses_what_it_cannot_mesh() -> None:
    for heights in (np.zeros((1, 5), np.float32), np.zeros((5, 1), np.float32), np.zeros((0, 0), np.float32)):
        with pytest.raises(ValueError):
            refine(heights, 1.0)
    for bad in (np.nan, np.inf):
        with pytest.raises(ValueError):
            refine(np.full((4, 4), bad, np.float32), 1.0)
    with pytest.raises(ValueError):
        refine(np.zeros((4, 4), np.float32), -1.0)
    with pytest.raises(ValueError):
        refine(np.zeros((4, 4), np.float32), float("nan"))


def test_a_16_bit_png_spans_black_to_white(tmp_path: Path) -> None:
    pixels = np.array([[0, 65535], [32768, 1]], np.uint16)
    field, warnings = read_heightmap(
        write(tmp_path / "h.png", pixels), size_x_m=1, size_z_m=1, height_m=24.0, base_m=-16.0
    )
    assert warnings == []
    assert field.heights_m[0].tolist() == [-16.0, 8.0]
    assert field.heights_m[1, 1] == pytest.approx(24.0 / 65535 - 16.0)


def test_floats_are_metres_and_8_bits_are_warned_about(tmp_path: Path) -> None:
    floats = np.array([[-3.5, 100.0], [0.25, 1.0]], np.float32)
    field, _ = read_heightmap(write(tmp_path / "h.exr", floats), size_x_m=1, size_z_m=1, height_m=None)
    assert field.heights_m.tolist() == floats.tolist()
    path = write(tmp_path / "h.png", np.array([[0, 255], [1, 2]], np.uint8))
    _, warnings = read_heightmap(path, size_x_m=1, size_z_m=1, height_m=255.0)
    assert len(warnings) == 1 and "8 bits" in warnings[0] and "1 m" in warnings[0]


@pytest.mark.parametrize(
    ("name", "pixels", "words"),
    [
        ("one.png", np.zeros((1, 1), np.uint16), "1 x 1"),
        ("row.png", np.zeros((1, 9), np.uint16), "9 x 1"),
        ("nan.exr", np.full((2, 2), np.nan, np.float32), "no height"),
        ("inf.exr", np.array([[0, 1], [2, np.inf]], np.float32), "(1, 1)"),
        ("both.exr", np.array([[np.nan, 1], [2, -np.inf]], np.float32), "(1, 1)"),
        ("far.exr", np.array([[0, 1e30], [2, 3]], np.float32), "(1, 0)"),
        ("color.png", np.arange(12, dtype=np.uint8).reshape(2, 2, 3), "colour"),
    ],
)
def test_what_is_no_heightmap_is_refused(
    tmp_path: Path, name: str, pixels: npt.NDArray[np.generic], words: str
) -> None:
    path = write(tmp_path / name, pixels)
    with pytest.raises(SourceError) as caught:
        read_heightmap(path, size_x_m=1, size_z_m=1, height_m=1.0)
    assert name in str(caught.value) and words in str(caught.value)


def test_the_glb_tells_the_measured_error(tmp_path: Path) -> None:
    heights = (hills(65, 65) * 5000 + 30000).astype(np.uint16)
    path = write(tmp_path / "h.png", heights)
    made = bake_terrain(path, TerrainSettings(size_m=(100, 100), height_m=20, max_error_m=0.1))
    (lod,) = decode_glb(made.glb)
    field, _ = read_heightmap(path, size_x_m=100, size_z_m=100, height_m=20)
    truth = terrain_error(lod.mesh, field)
    assert truth.max_m <= made.max_error_m <= 0.1
    assert made.rms_error_m == pytest.approx(truth.rms_m, rel=1e-5)
    assert made.triangles == len(lod.mesh.triangles) and made.warnings == []
    again = bake_terrain(path, TerrainSettings(size_m=(100, 100), height_m=20, max_error_m=0.1))
    assert again.glb == made.glb
    fast = bake_terrain(path, TerrainSettings(size_m=(100, 100), height_m=20, max_error_m=0.1), tier="fast")
    assert fast.tier == "fast" and fast.max_error_m <= 0.1 and fast.triangles > made.triangles


@given(st.floats(1e-9, 1e9))
@settings(max_examples=tries(60), deadline=None)
def test_a_stated_error_is_never_less_than_the_measured_one(error_m: float) -> None:
    assert error_m <= _six(error_m) <= 1.00002 * error_m


def test_a_bound_that_float32_cannot_hold_is_refused(tmp_path: Path) -> None:
    """Cliffs of 100 km in a terrain of 1,000 km: the rounding of x alone costs centimetres."""
    heights = np.zeros((2, 40), np.float32)
    heights[:, 1::2] = 1e5
    path = write(tmp_path / "cliff.exr", heights + np.linspace(0, 1, 40, dtype=np.float32))
    with pytest.raises(BakeError, match=r"float32|face up"):
        bake_terrain(path, TerrainSettings(size_m=(1e6, 1e6), height_m=1.0, max_error_m=1e-9))


@CORPUS_DEEP
def test_every_heightmap_keeps_its_bound(sources: Path) -> None:
    """With two bounds each: the true error falls with the asked one."""
    names = [path for path in sorted((sources / "height").rglob("*")) if path.suffix in (".png", ".exr")]
    greys = [path for path in names if "rgb" not in path.name]
    assert len(greys) >= 5
    for path in greys:
        field, _ = read_heightmap(path, size_x_m=1000, size_z_m=1000, height_m=100)
        reach = float(np.ptp(field.heights_m))
        small = Heightfield(np.ascontiguousarray(field.heights_m[:200, :200]), 1000.0, 1000.0)
        errors = []
        for bound_m in (0.05 * reach, 0.005 * reach):
            mesh = terrain_mesh(small, tolerance_m=bound_m, tier="balanced")
            error = terrain_error(mesh, small)
            assert error.max_m <= bound_m + 1e-6 * reach and error.holes == 0 and error.flipped == 0, path
            errors.append(error.max_m)
        assert errors[1] <= errors[0]


def test_the_result_is_json_for_the_command_line(tmp_path: Path, paradize_here) -> None:  # type: ignore[no-untyped-def]
    path = write(tmp_path / "h.png", np.arange(64, dtype=np.uint16).reshape(8, 8) * 900)
    out = tmp_path / "deep" / "h.glb"
    result = paradize_here(
        "terrain", path, "-o", out, "--size", 10, 20, "--height", 5, "--max-error", 0.1, "--json"
    )
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert report["max_error_m"] <= 0.1 and report["triangles"] >= 2 and report["warnings"] == []
    assert {"rms_error_m", "seconds"} <= report.keys() and out.is_file()


@pytest.mark.parametrize("size_m", [(40.0, 24.0), (1000.0, 777.0)])
def test_exact_is_nearest_of_all_tiers_and_spends_no_triangles_on_flat_ground(
    size_m: tuple[float, float],
) -> None:
    heights = np.maximum(hills(41, 25), 0.0).astype(np.float32)
    heights[:, :12] = 0.0  # the sea
    field = field_of(heights, *size_m)
    made = {
        tier: terrain_mesh(field, tolerance_m=0.3, tier=tier)
        for tier in ("fast", "balanced", "exact", "grid")
    }
    errors = {tier: terrain_error(mesh, field) for tier, mesh in made.items()}
    for tier in ("fast", "balanced"):
        assert errors["exact"].max_m <= errors[tier].max_m <= 0.3 + 1e-5
        assert errors["exact"].rms_m <= errors[tier].rms_m
    assert errors["exact"].max_m < 1e-4  # float32 alone
    count = {tier: len(mesh.triangles) for tier, mesh in made.items()}
    assert count["balanced"] < count["exact"] < 0.9 * count["grid"]
