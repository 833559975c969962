"""Promises of gutters: what bleeds is measured, what is safe is told, and what is not is found."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paradize.bakers.color import bake_color
from paradize.bakers.mesh.bake import bake_mesh
from paradize.build.bake import bake
from paradize.build.measurements.gutter_limits import measure_gutters
from paradize.build.options import BuildOptions
from paradize.build.trim import gutter_without_finest
from paradize.checks import check_paths
from paradize.checks.gutters import check_gutters
from paradize.data import Group, Lod, Mesh, Texture
from paradize.formats.glb.encode import encode_glb
from paradize.formats.ktx2.cut import cut_ktx2
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.kernels import gutter as kernel
from paradize.stages import gutter
from tests.pipeline.checks.test_rules import change, file_of, replace
from tests.pipeline.layouts import SIZE, cards, make_atlas_scene, rect, two_tone
from tests.pipeline.scenes import write_image
from tests.pipeline.small_scenes import cut
from tests.sweeps import sample

RED, GREEN, NEAR_RED = (200, 40, 30), (40, 180, 60), (190, 48, 38)


@pytest.fixture(autouse=True)
def store(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path_factory.getbasetemp() / "gutter-store"))


def baked(folder: Path, obj: str, picture: np.ndarray, **settings: object) -> Path:
    scene = make_atlas_scene(folder / "scene", obj, picture, **settings)
    scene = cut(cut(scene, "[fog]", "[[object]]"), "[[particles]]", "[flight]")
    report = bake(scene, folder / "out", BuildOptions(jobs=1))
    assert not report.errors
    return folder / "out"


def scene_of(scene: Path) -> dict[str, Any]:
    tree: dict[str, Any] = json.loads((scene / "scene.json").read_text())
    return tree


# The walk against a reference of its own: dense matrices, float64


def halving(size: int) -> np.ndarray:
    """(half, size): each row the area mean of the cells that a cell of the next level covers."""
    half = max(1, size // 2)
    edges = np.arange(half + 1) * size / half
    cells = np.arange(size)
    low = np.maximum(edges[:-1, None], cells[None])
    high = np.minimum(edges[1:, None], cells[None] + 1.0)
    return np.clip(high - low, 0.0, None) * half / size


def bilinear(at: float, size: int, repeat: bool) -> np.ndarray:
    first = int(np.floor(at - 0.5))
    row = np.zeros(size)
    for i, weight in ((first, 1.0 - (at - 0.5 - first)), (first + 1, at - 0.5 - first)):
        row[i % size if repeat else min(max(i, 0), size - 1)] += weight
    return row


def lifted(values: np.ndarray, kind: str) -> np.ndarray:
    """The quantity that is averaged: of normals (x, y) the vector, of colours with alpha their product."""
    if kind == "normal":
        x, y = values[..., :1], values[..., 1:]
        return np.concatenate([x, y, np.sqrt(np.maximum(0.0, 1.0 - x * x - y * y))], axis=-1)
    if kind == "color" and values.shape[-1] == 4:
        alpha = values[..., 3:] + 1e-4
        return np.concatenate([values[..., :3] * alpha, alpha], axis=-1)
    return values


def lowered(sums: np.ndarray, share: np.ndarray, kind: str) -> np.ndarray:
    """The values of which `share` of an area holds these sums."""
    if kind == "normal":
        return sums[..., :2] / np.maximum(np.linalg.norm(sums, axis=-1, keepdims=True), 1e-30)
    mean = sums / np.maximum(share, 1e-30)
    if kind == "color" and sums.shape[-1] == 4:
        colors = sums[..., :3] / np.maximum(sums[..., 3:], 1e-30)
        return np.concatenate([colors, mean[..., 3:] - 1e-4], axis=-1)
    return mean


def off_by(seen: np.ndarray, own: np.ndarray, kind: str) -> float:
    """Half the chord between normals; of colours the largest difference of square roots, times alpha."""
    if kind == "normal":
        return float(np.linalg.norm(lifted(seen, kind) - lifted(own, kind)) / 2)
    if kind == "value":
        return float(np.abs(seen - own).max())
    roots = np.sqrt(np.maximum(seen[:3], 0.0)) - np.sqrt(np.maximum(own[:3], 0.0))
    return float(np.abs(roots).max() * (np.clip(own[3], 0, 1) if len(own) == 4 else 1.0))


def p99(errors: list[float]) -> float:
    return errors[(len(errors) - 1) * 99 // 100]


def plain_walk(
    levels: list[np.ndarray], layout: kernel.Layout, reach: np.ndarray, kind: str
) -> list[dict[tuple[int, int], list[float]]]:
    """The errors of each border texel (y, x), by level."""
    rows, columns = layout.inside.shape
    filled = levels[0].reshape(-1, levels[0].shape[2])[layout.source].astype(np.float64)
    islands = np.unique(layout.owner)
    parts = {g: (layout.owner == g)[:, :, None] * lifted(filled, kind) for g in islands}
    shares = {g: (layout.owner == g).astype(np.float64)[:, :, None] for g in islands}
    whole = {g: (layout.inside & (layout.owner == g)).astype(np.float64)[:, :, None] for g in islands}
    half = 0.5**0.5
    ways = [
        (0, 0),
        (1, 0),
        (-1, 0),
        (0, 1),
        (0, -1),
        (half, half),
        (-half, half),
        (half, -half),
        (-half, -half),
    ]
    border = []
    for y, x in np.argwhere(layout.inside):
        for j in (-1, 0, 1):
            for i in (-1, 0, 1):
                if layout.repeat or (0 <= y + j < rows and 0 <= x + i < columns):
                    there = (y + j) % rows, (x + i) % columns
                    if not layout.inside[there] or layout.owner[there] != layout.owner[y, x]:
                        border.append((y, x))
    found = []
    for level in levels:
        h, w = level.shape[:2]
        errors: dict[tuple[int, int], list[float]] = {}
        for y, x in dict.fromkeys(border):
            g = layout.owner[y, x]
            if reach[g] < 0:
                continue
            inside = whole[g] > 1.0 - 1e-9
            own = np.where(inside, level, lowered(parts[g], shares[g], kind))
            for dx, dy in ways:
                # The texel's edge, the reach, and half a texel of the level.
                px = (x + 0.5 + 0.5 * np.sign(dx) + reach[g] * columns * dx) * w / columns + 0.5 * dx
                py = (y + 0.5 + 0.5 * np.sign(dy) + reach[g] * rows * dy) * h / rows + 0.5 * dy
                weights = np.outer(bilinear(py, h, layout.repeat), bilinear(px, w, layout.repeat))[:, :, None]
                seen = (weights * level).sum(axis=(0, 1))
                share = weights * shares[g]
                alone = (share * own).sum(axis=(0, 1)) / share.sum() if share.sum() > 1e-9 else filled[y, x]
                errors.setdefault((y, x), []).append(off_by(seen, alone, kind))
        found.append(errors)
        down, across = halving(h), halving(w)
        for each in (parts, shares, whole):
            for key in each:
                each[key] = np.einsum("ij,jkc,lk->ilc", down, each[key], across)
    return found


@pytest.mark.parametrize(
    ("touching", "kind", "channels", "rows", "columns", "repeat", "reach"),
    sample(
        (
            (touching, *of, *layout)
            for touching in (False, True)
            for of in [("value", 2), ("color", 3), ("color", 4), ("normal", 2)]
            for layout in [(16, 16, False, 0.0), (12, 20, True, 0.1), (9, 7, False, 0.3)]
        ),
        every=5,
    ),
)
def test_the_walk_finds_what_dense_matrices_find(
    rows: int, columns: int, repeat: bool, reach: float, touching: bool, kind: str, channels: int
) -> None:
    """touching: nothing lies between the islands, nor beyond the map's edge where it repeats."""
    rng = np.random.default_rng(rows)
    inside = np.zeros((rows, columns), np.bool_)
    ids = np.full((rows, columns), -1, np.int32)
    for k, (top, left) in enumerate([(1, 1), (1, columns - 3), (rows - 4, 2)]):
        ids[top : top + 3, left : left + 2 + k // 2] = k
    if touching:
        ids[1:-1], ids[1:-1, columns // 2 :], ids[1:3, 1:3] = 0, 1, 2
    inside = ids >= 0
    from paradize.kernels import maps

    source = maps.nearest_covered(inside, wrap=(repeat, repeat))
    layout = kernel.Layout(inside, source, ids.ravel()[source], repeat)
    levels = [rng.random((rows, columns, channels), np.float32)]
    if kind == "normal":
        levels[0] = np.float32(1.4) * levels[0] - np.float32(0.7)
    while max(levels[-1].shape[:2]) > 1:
        h, w = levels[-1].shape[:2]
        levels.append(np.einsum("ij,jkc,lk->ilc", halving(h), levels[-1], halving(w)).astype(np.float32))
    far = np.array([reach, -1.0, 0.5 * reach])
    expected = plain_walk(levels, layout, far, kind)
    for threads in (1, 3):
        found = kernel.walk(levels, kind, layout, far, threads=threads)
        for level, errors in zip(found, expected, strict=True):
            every = sorted(error for at in errors.values() for error in at)
            islands = {
                g: sorted(error for p, at in errors.items() if layout.owner[p] == g for error in at)
                for g in {int(layout.owner[p]) for p in errors}
            }
            worst = max(map(p99, islands.values()))
            assert level.samples == len(every)
            assert np.allclose((level.worst, level.all_p99), (every[-1], p99(every)), atol=1e-5)
            assert max(errors[level.y, level.x]) == pytest.approx(level.worst, abs=1e-5)
            of = islands[level.island]
            assert np.allclose((level.p99, p99(of), level.mean), (worst, worst, np.mean(of)), atol=1e-5)


def flat_mesh(obj_islands: list[list[tuple[float, float]]]) -> Mesh:
    points = np.array([p for corners in obj_islands for p in corners], np.float32) / np.float32(SIZE)
    faces, n = [], 0
    for corners in obj_islands:
        faces += [(n, n + i - 1, n + i) for i in range(2, len(corners))]
        n += len(corners)
    return Mesh(np.zeros((len(points), 3), np.float32), np.array(faces, np.uint32), uvs=points)


@pytest.mark.parametrize("gap", [2, 7, 16])
def test_the_width_is_half_the_distance_to_the_next_island(gap: int) -> None:
    mesh = flat_mesh([rect(4, 4, 20, 60), rect(20 + gap, 4, 60, 30), rect(20 + gap, 30 + 2 * gap, 60, 63)])
    found = gutter.find_islands(mesh, height=SIZE, width=SIZE, repeat=False)
    assert found is not None
    assert (found.count, found.width_texels) == (3, gap / 2)


@pytest.mark.parametrize("repeat", [False, True])
def test_the_distance_across_a_corner_is_the_diagonal(repeat: bool) -> None:
    """6 texels on and 8 down: ten, less the texel itself."""
    mesh = flat_mesh([rect(16, 16, 30, 30), rect(35, 37, 50, 50)])
    found = gutter.find_islands(mesh, height=SIZE, width=SIZE, repeat=repeat)
    assert found is not None
    assert (found.count, found.width_texels) == (2, 4.5)


@pytest.mark.parametrize("turned", [False, True])
def test_the_map_s_edge_is_no_distance_when_it_repeats(turned: bool) -> None:
    """Neither the right edge nor, with rows and columns exchanged, the lower one."""
    islands = [rect(2, 4, 20, 60), rect(40, 4, 61, 60)]
    mesh = flat_mesh([[(y, x) for x, y in island] for island in islands] if turned else islands)
    widths = []
    for repeat in (False, True):
        found = gutter.find_islands(mesh, height=SIZE, width=SIZE, repeat=repeat)
        assert found is not None
        widths.append(found.width_texels)
    assert widths == [10.0, 2.5]


@pytest.mark.parametrize("top", [4, 8])
def test_islands_without_a_whole_texel_between_them_are_one(top: int) -> None:
    """Whether or not they have a corner in common."""
    touching = flat_mesh([rect(4, 4, 20, 60), rect(20, top, 40, 60 - top), rect(42, 4, 60, 60)])
    found = gutter.find_islands(touching, height=SIZE, width=SIZE, repeat=False)
    assert found is not None
    assert found.count == 2
    assert found.of_triangle.tolist() == [0, 0, 0, 0, 1, 1]


def test_the_needed_width_grows_with_level_and_parallax() -> None:
    # A bilinear sample sees 1.5 texels of its level, a pixel's centre lies up to half of one outside.
    assert gutter.needed_texels(0, 0.0, 1024) == 2.0
    assert gutter.needed_texels(5, 0.0, 1024) == 64.0
    assert gutter.needed_texels(0, gutter.parallax_reach(0.02, -0.01), 1000) == 22.0
    for width in (1.0, 2.0, 7.9, 8.0, 300.0):
        level = gutter.level_by_width(width, 0.0, 1024, 10)
        assert level < 0 or gutter.needed_texels(level, 0.0, 1024) <= width
        assert gutter.needed_texels(level + 1, 0.0, 1024) > width


@pytest.mark.parametrize(
    ("pixel_m", "level"), [(None, 0), (0.01, 0), (0.1, 3), (0.125, 3), (0.126, 4), (9.0, 6)]
)
def test_the_level_in_use_and_the_width_it_needs_are_those_of_the_largest_pixel(
    pixel_m: float | None, level: int
) -> None:
    """64 texels a metre on a map of 64 x 32: a tenth of a metre covers 6.4 texels, so levels up to 8 a texel
    are read. The farther of two materials' parallax counts, along the longer side."""
    corners = [rect(4, 4, 20, 28), rect(40, 4, 60, 28)]
    texels = np.array([corner for island in corners for corner in island], np.float32)
    mesh = Mesh(
        np.column_stack([texels / 64, np.zeros(8)]).astype(np.float32),
        np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], np.uint32),
        uvs=texels / np.float32([64, 32]),
        groups=(Group("a", "wood", 0, 2), Group("b", "tin", 2, 2)),
    )
    sides = [(64 >> k, max(1, 32 >> k)) for k in range(7)]
    textures = {
        name: encode_ktx2(Texture(fmt, 64, 32, tuple(bytes([128]) * (w * h * size) for w, h in sides)))
        for name, fmt, size in (("color", "RGBA8_SRGB", 4), ("height", "R8_UNORM", 1))
    }
    glb = encode_glb((Lod(mesh, 0.0, 0.0),), "post")
    found = measure_gutters(
        glb,
        textures,
        name="post",
        parallax={"wood": (0.02, 0.0), "tin": (0.01, 0.05)},
        bleed=0.125,
        pixel_m=pixel_m,
    )
    assert found["limits"] == {"wood": None, "tin": None}
    color = found["maps"]["color"]
    assert color["level_in_use"] == level
    reach = gutter.parallax_reach(0.01, 0.05)
    assert reach > gutter.parallax_reach(0.02, 0.0) > 0.0
    assert color["needed_texels"] == pytest.approx(gutter.FOOTPRINT * 2**level + 64 * reach, rel=1e-5)


def test_shader_and_gutters_share_the_steepest_look(root: Path) -> None:
    text = (root / "shaders/lib/parallax.glsl").read_text()
    found = re.search(r"const float STEEPEST = ([0-9.]+);", text)
    assert found is not None
    assert float(found[1]) == gutter.STEEPEST


# The entries of scene.json


def test_islands_of_two_colours_that_stand_close_stop_the_mips(tmp_path: Path) -> None:
    levels = {}
    for gap in (2, 8, 24):
        artifact = scene_of(baked(tmp_path / str(gap), *two_tone(gap, RED, GREEN)))["artifacts"]["post_color"]
        levels[gap] = artifact["max_level"]
        assert artifact["gutter"]["width_texels"] == gap / 2
        assert artifact["gutter"]["level_by_width"] <= artifact["max_level"]
        assert artifact["gutter"]["islands"] == 2
    assert levels[2] < levels[8] <= levels[24]
    assert levels[2] <= 1


def test_neighbours_of_nearly_one_colour_bleed_harmlessly(tmp_path: Path) -> None:
    artifact = scene_of(baked(tmp_path, *two_tone(2, RED, NEAR_RED)))["artifacts"]["post_color"]
    assert artifact["max_level"] is None
    assert max(artifact["gutter"]["bleed_p99"]) < artifact["gutter"]["bound"]


def test_a_scene_says_how_much_it_accepts(tmp_path: Path) -> None:
    artifact = scene_of(baked(tmp_path, *two_tone(2, RED, GREEN), bleed=1.0))["artifacts"]["post_color"]
    assert (artifact["max_level"], artifact["gutter"]["bound"]) == (None, 1.0)


def test_a_map_that_tiles_has_no_gutter(tmp_path: Path) -> None:
    scene = scene_of(baked(tmp_path, *two_tone(2, RED, GREEN), wrap='"repeat"'))
    assert scene["artifacts"]["post_color"]["gutter"] is None
    assert scene["objects"][0]["materials"]["wood"]["wrap"] == ["repeat", "repeat"]


def test_maps_repeat_only_where_uvs_leave_the_picture(tmp_path: Path) -> None:
    _, picture = two_tone(8, RED, GREEN)
    for name, left, wrap in (("inside", 4.0, None), ("outside", -4.0, ["repeat", "repeat"])):
        obj = cards([rect(left, 4, 28, 60), rect(36, 4, 56, 60)])
        item = scene_of(baked(tmp_path / name, obj, picture, wrap='"auto"'))["objects"][0]
        assert item["materials"]["wood"]["wrap"] == wrap


def test_parallax_beyond_the_gutter_is_limited_to_what_is_safe(tmp_path: Path) -> None:
    limits = {}
    for gap in (4, 16):
        scene = scene_of(baked(tmp_path / str(gap), *two_tone(gap, RED, GREEN), parallax_scale=0.4))
        facts = scene["artifacts"]["post_color"]["gutter"]
        assert facts["bleed_p99"][0] <= facts["bound"]
        assert facts["bleed_max"][0] <= gutter.WORST * facts["bound"]
        material = scene["objects"][0]["materials"]["wood"]
        limits[gap] = material["parallax_limit"]
        assert material["parallax_scale"] == 0.4
        # A sample and its filter stay on the island's own half of the gap.
        assert limits[gap] * SIZE <= gap / 2 + 0.5
        assert limits[gap] * SIZE >= gap / 2 - 2.0
    small = scene_of(baked(tmp_path / "small", *two_tone(16, RED, GREEN), parallax_scale=0.05))
    assert small["objects"][0]["materials"]["wood"]["parallax_limit"] is None
    assert limits[4] < limits[16] < 0.2


def test_the_level_in_use_follows_the_flight(tmp_path: Path) -> None:
    far = scene_of(baked(tmp_path / "far", *two_tone(8, RED, GREEN)))
    small = scene_of(baked(tmp_path / "small", *two_tone(8, RED, GREEN), viewport="[64, 36]"))
    levels = [scene["artifacts"]["post_color"]["gutter"]["level_in_use"] for scene in (far, small)]
    assert levels[1] > levels[0]


# The findings of `paradize check`


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    top = tmp_path_factory.mktemp("atlas")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PARADIZE_STORE", str(top / "store"))
        return baked(top, *two_tone(16, RED, GREEN), parallax_scale=0.05)


@pytest.fixture
def scene(sound: Path, tmp_path: Path) -> Path:
    shutil.copytree(sound, tmp_path / "out")
    return tmp_path / "out"


def paint(level: int, first: int, last: int, column: slice = slice(None)) -> Callable[[Path], None]:
    """Blackens columns of blocks of one level of the colour map (BC1: a zero block is black)."""

    def plant(scene: Path) -> None:
        texture = decode_ktx2(file_of(scene, "post_color").read_bytes())
        assert texture.format == "BC1_RGB_SRGB"
        across = max(1, (SIZE >> level) // 4)
        blocks = np.frombuffer(texture.levels[level], np.uint8).reshape(-1, across, 8).copy()
        blocks[column, first:last] = 0
        levels = list(texture.levels)
        levels[level] = blocks.tobytes()
        replace(scene, "post_color", encode_ktx2(dataclasses.replace(texture, levels=tuple(levels))))

    return plant


def unfilled(scene: Path) -> None:
    """The colour map as it is when nobody knows of its layout: black between its islands, in every mip."""
    path = scene / "plain.png"
    write_image(path, two_tone(16, RED, GREEN)[1])
    replace(scene, "post_color", bake_color(path).data)
    path.unlink()


def far_parallax(scene: Path) -> None:
    change(scene, lambda m: m["objects"][0]["materials"]["wood"].update(parallax_scale=0.6))


def test_check_sees_what_the_bakes_own_measuring_misses(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither its islands nor its verdict are the bake's."""
    unfilled(scene)
    monkeypatch.setattr(gutter, "find_islands", lambda *_, **__: None)
    monkeypatch.setattr(gutter, "is_safe", lambda *_: True)
    assert "PZ221" in {finding.code for finding in check_paths([scene])}


def end_at(last: int | None) -> Callable[[Path], Any]:
    """Plants a map that the flight uses down to level 4, and whose last level that is sampled is `last`."""

    def edit(tree: dict[str, Any]) -> None:
        entry = tree["artifacts"]["post_color"]
        bleed = [0.0, 0.01, 0.1, 0.15, 0.2002] + [0.9] * (len(entry["levels"]) - 5)
        facts = {"level_in_use": 4, "bound": 0.125, "bleed_p99": bleed, "bleed_max": [2.0 * b for b in bleed]}
        entry.update(max_level=last, gutter=entry["gutter"] | facts)

    return lambda scene: change(scene, edit)


GUTTER_FAULTS: list[tuple[str, str, Callable[[Path], Any]]] = [
    ("PZ221", "a black gutter", unfilled),
    ("PZ221", "a single black block beside a border", paint(0, 6, 7, slice(8, 9))),
    ("PZ221", "a gutter that is black in one mip", paint(2, 2, 3, slice(0, 1))),
    ("PZ222", "a parallax beyond the gutter", far_parallax),
    ("PZ223", "a map that ends two levels too early", end_at(2)),
]


def test_sound_gutters_are_clean(sound: Path) -> None:
    assert check_paths([sound]) == []


@pytest.mark.parametrize(("code", "fault", "plant"), GUTTER_FAULTS, ids=[f for _, f, _ in GUTTER_FAULTS])
def test_the_rule_fires_and_no_other_error_does(
    scene: Path, code: str, fault: str, plant: Callable[[Path], Any]
) -> None:
    plant(scene)
    findings = check_paths([scene])
    assert {one.code for one in findings if one.severity == "error" or one.code == code} == {code}, findings


def test_a_black_gutter_is_found_at_its_place(scene: Path) -> None:
    paint(0, 6, 7, slice(8, 9))(scene)  # texels 24 to 27 across, 32 to 35 down; the left island ends at 24
    (finding,) = check_paths([scene])
    assert finding.file == str(file_of(scene, "post_color"))
    place = re.fullmatch(r"post_color level (\d+) texel \((\d+), (\d+)\)", finding.place)
    assert place is not None
    level, x, y = map(int, place.groups())
    assert level == 0
    assert (x, 31 <= y <= 36) == (23, True)


def without_finest(scene: Path) -> None:
    """Leaves the finest level of the colour map out, as a bake does that no view needs."""
    data = cut_ktx2(file_of(scene, "post_color").read_bytes(), 1, zstd_level=None)
    replace(scene, "post_color", data)
    detail: dict[str, Any] = {
        "left_out": 1,
        "saved_bytes": 1,
        "texels": 9.0,
        "second_s": 0.0,
        "view": "camera",
    }

    def edit(tree: dict[str, Any]) -> None:
        entry = tree["artifacts"]["post_color"]
        facts = gutter_without_finest(entry["gutter"] | {"max_level": entry["max_level"]}, 1)
        entry.update(
            required_detail=detail | {"levels_s": [0.0]},
            max_level=facts.pop("max_level"),
            gutter=facts,
            levels=entry["levels"][1:],
        )

    change(scene, edit)


def test_a_fault_is_named_by_the_level_that_is_published(scene: Path) -> None:
    """The finest level is left out: what was level 1 is level 0 now, with half as many texels."""
    without_finest(scene)
    assert check_paths([scene]) == []
    far_parallax(scene)
    found = [one for one in check_paths([scene]) if one.place.startswith("post_color level 0 ")]
    (finding,) = found
    place = re.fullmatch(r"post_color level 0 texel \((\d+), (\d+)\)", finding.place)
    assert finding.code == "PZ222" and place is not None
    assert int(place[1]) in (11, 20) and 2 <= int(place[2]) <= 29  # the islands' borders at the gap


def test_a_wrong_gutter_is_found_where_the_finest_level_is_left_out(scene: Path) -> None:
    paint(1, 3, 4, slice(4, 5))(scene)  # texels 12 to 15 of 32 across: beside the left island's border
    without_finest(scene)
    found = next(finding for finding in check_paths([scene]) if finding.code == "PZ221")
    assert "the gutter is" in found.what
    place = re.fullmatch(r"post_color level 0 texel \((\d+), (\d+)\)", found.place)
    assert place is not None and abs(int(place[1]) - 12) <= 2 and 14 <= int(place[2]) <= 21


def test_a_measure_beyond_the_bound_is_told_where_the_finest_level_is_left_out(scene: Path) -> None:
    without_finest(scene)
    last = scene_of(scene)["artifacts"]["post_color"]["max_level"]
    for bleed, place in (
        ({"bleed_p99": [0.0] * last + [0.13], "bleed_max": [0.0] * last + [0.2]}, f"post_color level {last}"),
        ({"bleed_p99": [0.1], "bleed_max": [0.32]}, "post_color level 0"),
    ):
        change(scene, lambda m, new=bleed: m["artifacts"]["post_color"]["gutter"].update(new))
        (finding,) = check_paths([scene])
        assert (finding.code, finding.place) == ("PZ221", place)
        assert "when it was baked; 0.125 is accepted" in finding.what
    read_by_none = {"bleed_p99": [0.0] * (last + 1) + [0.9], "bleed_max": [0.0] * (last + 1) + [0.9]}
    change(scene, lambda m: m["artifacts"]["post_color"]["gutter"].update(read_by_none))
    assert check_paths([scene]) == []


def dark_edged(folder: Path, edge: int) -> tuple[bytes, bytes, dict[str, Any]]:
    """(GLB, colour map, its gutters) of two islands, 16 texels apart, each with a dark edge `edge` texels
    wide."""
    obj, picture = two_tone(16, RED, GREEN)
    for left, right in ((4, 24), (40, 60)):
        picture[4:60, left:right] //= 8
        picture[4 + edge : 60 - edge, left + edge : right - edge] *= 8
    (folder / "post.obj").write_text(obj)
    write_image(folder / "post.png", picture)
    glb = bake_mesh(folder / "post.obj", lods=1).glb
    data = bake_color(folder / "post.png", uv=folder / "post.obj", tier="exact").data
    parallax = {"wood": (0.0, 0.0)}
    found = measure_gutters(glb, {"color": data}, name="post", parallax=parallax, bleed=0.125, pixel_m=None)
    return glb, data, found["maps"]["color"]


def test_busy_borders_of_a_map_without_its_finest_level_are_no_bleeding(tmp_path: Path) -> None:
    """Islands with an outline one texel wide, which their gutters repeat: the mean of outline and island is
    another colour."""
    glb, data, measured = dark_edged(tmp_path, 1)
    facts = gutter_without_finest(measured, 1)
    cut_data = cut_ktx2(data, 1, zstd_level=None)
    manifest = one_map_manifest(tmp_path, glb, cut_data, facts, color_left_out=1)
    assert list(check_gutters(manifest, tmp_path)) == []
    manifest["artifacts"]["color"]["gutter"] = facts | {"bound": 0.001}
    assert list(check_gutters(manifest, tmp_path))


def one_map_manifest(
    folder: Path, glb: bytes, color: bytes, gutter: dict[str, Any], **left_out: int
) -> dict[str, Any]:
    """The parts of a scene.json that `check_gutters` reads, of one mesh with one map; writes both files."""
    files = {"mesh": glb, "color": color}
    for name, content in files.items():
        (folder / name).write_bytes(content)
    entries: dict[str, dict[str, Any]] = {
        "mesh": {"gutter": None, "max_level": None},
        "color": {"gutter": gutter, "max_level": gutter.pop("max_level")},
    }
    for name, entry in entries.items():
        count = left_out.get(f"{name}_left_out")
        entry |= {"file": name, "bytes": len(files[name])}
        entry["required_detail"] = None if count is None else {"left_out": count}
    part = {"maps": {"color": "color", "height": None}, "wrap": None}
    return {"objects": [{"mesh": "mesh", "materials": {"wood": part}}], "artifacts": entries}


def test_islands_that_simplification_moved_are_no_bleeding(tmp_path: Path) -> None:
    """The finest level of detail is left out, and the islands of the next end inside those of the map, which
    has a dark edge there."""
    _, data, measured = dark_edged(tmp_path, 3)
    (tmp_path / "moved.obj").write_text(cards([rect(8, 8, 20, 56), rect(44, 8, 56, 56)]))
    moved = bake_mesh(tmp_path / "moved.obj", lods=1).glb

    def codes(gutter: dict[str, Any], left_out: int) -> set[str]:
        manifest = one_map_manifest(tmp_path, moved, data, dict(gutter), mesh_left_out=left_out)
        return {finding.code for finding in check_gutters(manifest, tmp_path)}

    assert codes(measured, 1) == set()
    assert codes(measured, 0) == {"PZ221"}  # were they as the map has them, it would be the map's fault
    assert codes(measured | {"bound": 0.001}, 1) == {"PZ221"}  # what the other island bleeds is found


def test_parallax_is_held_to_its_limit_whatever_is_asked(scene: Path) -> None:
    wood = {"parallax_scale": 0.6, "parallax_limit": 0.025}
    change(scene, lambda m: m["objects"][0]["materials"]["wood"].update(wood))
    assert check_paths([scene]) == []


def test_mips_that_end_before_the_flight_stops_using_them_are_told(scene: Path) -> None:
    def told(last: int | None) -> list[str]:
        end_at(last)(scene)
        return [finding.what for finding in check_paths([scene]) if finding.code == "PZ223"]

    (what,) = told(2)
    assert "level 2 is the last" in what and "level 4" in what
    assert "bleed of 0.125 would have to be 0.201" in what
    assert len(told(3)) == 1
    assert told(4) == told(5) == told(None) == []


def test_what_lies_far_from_every_border_is_no_bleeding(scene: Path) -> None:
    paint(0, 2, 3, slice(5, 6))(scene)  # inside the left island
    assert check_paths([scene]) == []
