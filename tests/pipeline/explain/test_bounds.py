"""The bounds that `explain` tells hold: no place of a source's surface, projected in float64 at many moments
of the flight, is farther from what the player draws of it, and no texel is farther off."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest
from scipy.spatial import cKDTree

from paradize.explain.bounds import bound_short, bound_words, bounds_of, mixed
from paradize.explain.facts import explain
from paradize.formats.glb.reader import decode_glb
from paradize.formats.glb.tiles import decode_tile
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.texels import decode_texels
from paradize.scene.flight import Flight
from tests.pipeline.bakes import bake_apart
from tests.pipeline.scenes import make_cove
from tests.sweeps import sweep

F64 = npt.NDArray[np.float64]
MOMENTS = 240
FREE = "[free_camera]\nlow = [4, 3, 4]\nhigh = [8, 6, 8]\nnear_m = 0.5\n"


@pytest.fixture(
    scope="module", params=sweep(["flight", "free camera", "swift", "by sight"], test=["free camera"])
)
def baked(
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
    cove_store: Callable[[Path], Path],
) -> tuple[Path, Path, Any]:
    """(scene, its bake, its bounds): the cove with codes for vertices, seen from its flight, also from a box,
    with a wide view from near by, or with levels for a view from afar."""
    top = tmp_path_factory.mktemp("bounds")
    cove_store(top / "store")
    scene = make_cove(top / "scene")
    text = scene.read_text().replace("lods = 3\n", "lods = 3\nquantise = true\n")
    text = text.replace(
        'name = "cove"\n',
        'name = "cove"\nviewport = [640, 360]\nlod_error_deg = 180\nlod_silhouette = 1\nlod_flip = 1\n',
    )
    if request.param == "free camera":
        text += FREE
    if request.param == "by sight":  # level 0 is simplified
        text = text.replace("lods = 3", 'lods = 3\nlods_by = "flight"').replace("[9, 2, 0]", "[19, 2, 0]")
        text = text.replace("[0, 2, 9]", "[0, 2, 19]").replace("[-9, 2, 0]", "[-19, 2, 0]")
        text = text.replace("[0, 2, -9]", "[0, 2, -19]").replace("[640, 360]", "[64, 36]")
    if request.param == "swift":
        text = text.replace("[flight]\n", "[flight]\nfov_deg = 85\n").replace(
            "lods = 3", "lods = 3\nlod_ratio = 0.3"
        )
        text = text.replace("[9, 2, 0]", "[5, 3.5, 1]").replace("[0, 2, 9]", "[0, 4, 70]")
    scene.write_text(text)
    bake_apart(scene, top)
    manifest = json.loads((top / "out" / "scene.json").read_text())
    return scene, top / "out", (manifest, bounds_of(manifest, top / "out"))


class View:
    """A pinhole camera; roll changes no distance in its picture."""

    def __init__(self, manifest: dict[str, Any], eye: F64, target: F64) -> None:
        width, height = manifest["largest_viewport"]
        tangent = np.tan(0.5 * manifest["flight"]["fov_rad"])
        self.eye, self.pixels = eye, height / (2.0 * tangent)
        self.near_m = manifest["flight"]["near_m"]
        self.corner = 1.0 / np.sqrt(1.0 + tangent**2 * (1.0 + (width / height) ** 2))
        self.ahead = (target - eye) / np.linalg.norm(target - eye)
        up = np.array([0.0, 1.0, 0.0]) if abs(self.ahead[1]) < 0.99 else np.array([1.0, 0.0, 0.0])
        self.right = np.cross(self.ahead, up)
        self.right /= np.linalg.norm(self.right)
        self.up = np.cross(self.right, self.ahead)

    def moved(self, shown: F64, matched: F64) -> F64:
        """Pixels between pairs of places (n, 3), of those whose first the picture may show."""
        a, b = shown - self.eye, matched - self.eye
        depth = a @ self.ahead
        seen = (depth >= self.near_m) & (depth >= self.corner * np.linalg.norm(a, axis=1))
        a, b = a[seen], b[seen]
        px = [np.stack([v @ self.right, v @ self.up], axis=1) / (v @ self.ahead)[:, None] for v in (a, b)]
        return self.pixels * np.linalg.norm(px[0] - px[1], axis=1)


def views(manifest: dict[str, Any]) -> Iterator[View]:
    flight = Flight.from_json(manifest["flight"])
    for moment in np.linspace(0.0, flight.duration_s, MOMENTS, endpoint=False):
        eye, target = flight.view(float(moment))
        yield View(manifest, np.array(eye), np.array(target))
    if box := manifest["free_camera"]:
        rng = np.random.default_rng(5)
        for eye in rng.uniform(box["low"], box["high"], (MOMENTS, 3)):
            yield View(manifest, eye, rng.uniform(-3.0, 3.0, 3))


def read_source(path: Path) -> F64:
    """Triangles (n, 3, 3) of an OBJ of four-sided faces, as its text has them."""
    rows = [line.split() for line in path.read_text().splitlines()]
    places = np.array([[float(x) for x in row[1:]] for row in rows if row[0] == "v"])
    faces = np.array([[int(x.split("/")[0]) - 1 for x in row[1:]] for row in rows if row[0] == "f"])
    triangles = places[np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])]
    area = np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    return np.asarray(triangles[area > 1e-9], np.float64)


def spread(triangles: F64, parts: int = 3) -> F64:
    """Places all over triangles, those of sides and corners that triangles share once."""
    u, v = (grid.ravel() / parts for grid in np.mgrid[0 : parts + 1, 0 : parts + 1])
    u, v = u[u + v <= 1.0], v[u + v <= 1.0]
    a, b, c = (triangles[:, None, k] for k in range(3))
    places = np.asarray((a + u[:, None] * (b - a) + v[:, None] * (c - a)).reshape(-1, 3))
    return places[np.unique(places.round(9), axis=0, return_index=True)[1]]


def nearest(places: F64, triangles: F64) -> F64:
    """The nearest place on the triangles to each place: among the inner ones and those on the sides."""
    spots = triangles.reshape(-1, 3)
    least, at = cKDTree(spots).query(places)
    everywhere, nearest_yet = places, spots[at]
    for a, b, c in triangles:
        middle = (a + b + c) / 3.0
        reach = max(np.linalg.norm(spot - middle) for spot in (a, b, c))
        rows = np.flatnonzero(np.linalg.norm(everywhere - middle, axis=1) - reach <= least)
        places, best, found = everywhere[rows], least[rows], nearest_yet[rows]
        normal = np.cross(b - a, c - a)
        candidates = []
        square = normal @ normal
        if square > 0.0:
            flat = places - ((places - a) @ normal / square)[:, None] * normal
            inside = np.ones(len(places), np.bool_)
            for p, q in ((a, b), (b, c), (c, a)):
                inside &= np.cross(q - p, flat - p) @ normal >= 0.0
            candidates.append(np.where(inside[:, None], flat, a))
        for p, q in ((a, b), (b, c), (c, a)):
            along = (q - p) @ (q - p)
            share = (
                np.clip((places - p) @ (q - p) / along, 0.0, 1.0) if along > 0.0 else np.zeros(len(places))
            )
            candidates.append(p + share[:, None] * (q - p))
        for candidate in candidates:
            away = np.linalg.norm(candidate - places, axis=1)
            better = away < best
            best[better], found[better] = away[better], candidate[better]
        least[rows], nearest_yet[rows] = best, found
    return nearest_yet


def stand(places: F64, instance: dict[str, Any]) -> F64:
    x, y, z, w = instance["rotation"]
    turn = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.asarray(instance["position"] + (places * instance["scale"]) @ np.array(turn).T)


def taken(item: dict[str, Any], instance: dict[str, Any], view: View, asked_px: float) -> int:
    """The player's rule (player/streaming/scene.cpp, choose_lod)."""
    center = stand(np.array([item["center"]]), instance)[0]
    scale = max(map(abs, instance["scale"]))
    away = max(np.linalg.norm(view.eye - center) - item["radius_m"] * scale, 1e-3)
    levels = range(len(item["lods"]) - 1, 0, -1)
    errors = [lod["error_m"] * scale * view.pixels / away for lod in item["lods"]]
    return next((level for level in levels if errors[level] <= asked_px), 0)


@pytest.mark.parametrize(
    "quality, share", sweep([("exact", 0.25), ("balanced", 1.0), ("fast", 3.0)], test=[("balanced", 1.0)])
)
def test_no_place_of_a_mesh_moves_farther_in_any_picture(baked: Any, quality: str, share: float) -> None:
    scene, out, (manifest, bounds) = baked
    (item,) = manifest["objects"]
    source = read_source(scene.parent / "post.obj")
    drawn = decode_glb((out / manifest["artifacts"]["post_mesh"]["file"]).read_bytes(), "post")
    pairs = []
    for lod in drawn:
        level = lod.mesh.absolute_positions[lod.mesh.triangles].astype(np.float64)
        ours, back = spread(source), spread(level)
        pairs.append([(ours, nearest(ours, level)), (back, nearest(back, source))])
    result = bounds["post_mesh"]
    largest = [0.0] * len(drawn)
    there = [
        (instance, [[(stand(a, instance), stand(b, instance)) for a, b in level] for level in pairs])
        for instance in item["instances"]
    ]
    for view in views(manifest):
        for instance, stood in there:
            level = taken(item, instance, view, share * manifest["lod_error_px"])
            for a, b in stood[level]:
                px = view.moved(a, b)
                largest[level] = max(largest[level], float(px.max(initial=0.0)))
    first = result["terms"][0]
    assert first["name"] == "level 0"
    limit = result["value"]
    if quality == "fast":
        coarse = next(term["value"] for term in result["terms"] if "fast" in term["name"])
        limit = max(first["value"], coarse)
    assert largest[0] <= first["value"] and max(largest) <= limit, (largest, result)
    if largest[0] > 0.0:  # what is less than 0.05 pixels is not looked at closer
        assert first["value"] < max(0.05, 4.0 * largest[0]), (largest, result)
    if quality != "exact" and max(largest[1:]) > 0.0:
        assert limit < 4.0 * max(largest), (largest, result)
    assert sum(first["parts"].values()) == pytest.approx(first["value"])
    assert first["parts"]["quantisation"] > first["parts"]["loading"] > 0.0
    simplified = manifest["artifacts"]["post_mesh"]["levels"][0]["triangles"] < len(source)
    assert ("simplification" in first["parts"]) == simplified


def cut(terrain: dict[str, Any], view: View, asked_px: float) -> list[int]:
    """The patches that the player draws (formats/FORMAT.md)."""
    patches, diamonds = terrain["patches"], terrain["diamonds"]
    split: set[int] = set()
    for d in range(len(diamonds["error_m"])):
        makers = [patches["made_by"][p] for p, own in enumerate(patches["diamond"]) if own == d]
        away = np.linalg.norm(view.eye - np.array(diamonds["center"][d])) - diamonds["radius_m"][d]
        wanted = diamonds["error_m"][d] * view.pixels > asked_px * max(view.near_m, away)
        if wanted and all(maker == -1 or maker in split for maker in makers):
            split.add(d)
    return [
        p
        for p, (maker, own) in enumerate(zip(patches["made_by"], patches["diamond"], strict=True))
        if (maker == -1 or maker in split) and (own == -1 or own not in split)
    ]


def test_no_pixel_of_the_heights_moves_farther_in_any_picture(baked: Any) -> None:
    scene, out, (manifest, bounds) = baked
    terrain = manifest["terrain"]
    codes = np.asarray(oiio.ImageBuf(str(scene.parent / "height.png")).get_pixels(oiio.UINT16))[:, :, 0]
    count = len(codes)
    z, x = (axis.ravel() * 20.0 / (count - 1) - 10.0 for axis in np.mgrid[0:count, 0:count])
    truth = np.stack([x, codes.ravel() / 65535.0 * 4.0 - 2.0, z], axis=1)
    tile = decode_tile((out / manifest["artifacts"]["terrain_mesh"]["file"]).read_bytes())
    pairs = []
    for patch in tile:
        rows = []
        for a, b, c in patch.mesh.absolute_positions[patch.mesh.triangles].astype(np.float64):
            sides = np.array([b - a, c - a])[:, [0, 2]]
            u, v = np.linalg.solve(sides.T, (truth - a)[:, [0, 2]].T)
            inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9)
            heights = (a[1] + u * (b - a)[1] + v * (c - a)[1])[inside]
            on = truth[inside]
            rows.append((on, np.stack([on[:, 0], heights, on[:, 2]], axis=1)))
        pairs.append([np.concatenate(part) for part in zip(*rows, strict=True)])
    largest = 0.0
    for view in views(manifest):
        for p in cut(terrain, view, manifest["lod_error_px"]):
            for a, b in (pairs[p], pairs[p][::-1]):
                largest = max(largest, float(view.moved(a, b).max(initial=0.0)))
    result = bounds["terrain_mesh"]
    assert 0.0 < largest <= result["value"] < 10.0 * largest, (largest, result)


def linear(code: F64) -> F64:
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def encoded(light: F64) -> F64:
    safe = np.maximum(light, 1e-12)
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * safe ** (1.0 / 2.4) - 0.055)


def test_no_texel_of_a_colour_and_no_mix_of_texels_is_farther_off(baked: Any) -> None:
    scene, out, (manifest, bounds) = baked
    entry = manifest["artifacts"]["post_color"]
    texture = decode_ktx2((out / entry["file"]).read_bytes(), "post_color")
    pixels = np.asarray(oiio.ImageBuf(str(scene.parent / "wood.png")).get_pixels(oiio.UINT8))[:, :, :3]
    light = linear(pixels / 255.0)
    result = bounds["post_color"]
    texel = result["terms"][0]["value"]
    largest, rng = 0.0, np.random.default_rng(3)
    left_out, last = entry["required_detail"]["left_out"], entry["max_level"]
    for level in range(left_out, len(light).bit_length() if last is None else left_out + last + 1):
        side, step = len(light) >> level, 1 << level
        truth = light.reshape(side, step, side, step, 3).mean(axis=(1, 3)).reshape(-1, 3)
        shown = decode_texels(texture, level - left_out)[:, :, :3].reshape(-1, 3)
        off = np.abs(encoded(truth) - shown)
        largest = max(largest, float(255.0 * off.max()))
        pick, weight = rng.integers(0, len(truth), (20_000, 4)), rng.dirichlet([0.5] * 4, 20_000)
        mixes = [(weight[:, :, None] * part[pick]).sum(axis=1) for part in (truth, linear(shown))]
        assert 255.0 * np.abs(encoded(mixes[0]) - encoded(mixes[1])).max() <= result["value"]
    assert largest <= texel * (1.0 + 1e-6) and texel <= largest * 1.001
    assert result["value"] == pytest.approx(255.0 * mixed(texel / 255.0))


def test_the_worst_mix_of_two_texels_is_inside_what_mixing_is_said_to_add() -> None:
    weights = np.linspace(0.0, 1.0, 201)[:, None]
    bright = np.linspace(0.0, 1.0, 501)
    closest = 0.0
    for share in (0.0005, 0.002, 0.01, 0.02, 0.028, 0.0307, 0.035, 0.05, 0.1, 0.4, 1.0):
        worst = 0.0
        for dark in (0.0, 0.002, 0.01, 0.04):
            true = weights * linear(np.array(dark)) + (1.0 - weights) * linear(bright)
            shown = weights * linear(np.array(min(1.0, dark + share)))
            shown = shown + (1.0 - weights) * linear(np.minimum(1.0, bright + share))
            worst = max(worst, float((encoded(shown) - encoded(true)).max()))
        assert share - 1e-9 <= worst <= mixed(share) + 1e-12, share
        closest = max(closest, (worst - share) / (mixed(share) - share)) if share < 1.0 else closest
    assert closest > 0.95


def words(facts: dict[str, Any]) -> str:
    return "\n".join(bound_words(facts))


def test_every_artifact_has_lines_that_call_only_bounds_at_most(baked: Any) -> None:
    scene, out, (manifest, bounds) = baked
    assert bounds.keys() == manifest["artifacts"].keys()
    explanation = explain(scene, out=out)
    for result in explanation.artifacts:
        assert result["bound"] == bounds[result["name"]]
        assert all("\n" not in line for line in bound_words(result["bound"]))
    json.dumps(explanation.as_json(), allow_nan=False)
    mesh = words(bounds["post_mesh"])
    assert re.match(
        r"on the screen its surface lies at most [\d.]+ px from where .*: level \d.*, seen at second", mesh
    )
    assert "quantisation" in mesh and "not bounded: how far its texture slides" in mesh
    assert "what parallax makes of it" in words(bounds["post_height"])
    assert "mixes of texels" in words(bounds["sand_normal"])
    assert words(bounds["sound"]) == "its bytes are those of its source"


def test_what_scene_json_does_not_tell_is_no_bound(baked: Any) -> None:
    _, out, (manifest, _) = baked
    changed = json.loads(json.dumps(manifest))
    for level in changed["artifacts"]["post_mesh"]["levels"]:
        del level["error_max"]
    changed["artifacts"]["post_color"]["levels"] = []
    found = bounds_of(changed, out)
    for name in ("post_mesh", "post_color"):
        assert found[name]["value"] is None
        assert "at most" not in bound_words(found[name])[0] and bound_short(found[name]) == "no bound"


def test_triangles_that_cannot_be_read_only_make_the_bound_wider(baked: Any, tmp_path: Path) -> None:
    _, _, (manifest, bounds) = baked
    found = bounds_of(manifest, tmp_path)
    for name in ("post_mesh", "terrain_mesh"):
        assert found[name]["value"] >= bounds[name]["value"]


ODD_PATHS = [(key, value) for key in ("table", "segment") for value in (1e300, -1e300, 1e12)]


@pytest.mark.parametrize(("key", "value"), sweep(ODD_PATHS, test=[("segment", 1e300)]))
def test_a_path_that_is_no_path_ends_without_a_bound_that_is_no_number(
    baked: Any, key: str, value: float
) -> None:
    _, out, (manifest, _) = baked
    changed = json.loads(json.dumps(manifest))
    if key == "table":
        changed["flight"]["time_table"][1][2] = value
    else:
        changed["flight"]["segments"][0]["eye"][0] = [value, -value, value, value]
    found = bounds_of(changed, out)
    json.dumps(found, allow_nan=False)
    if key == "segment" and abs(value) > 1e100:
        assert found["post_mesh"]["value"] is found["terrain_mesh"]["value"] is None
