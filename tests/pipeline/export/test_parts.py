"""Parts of an exported scene against closed forms and conventions that others wrote down."""

from __future__ import annotations

import json
import math
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from paradize.data import Group, Texture
from paradize.export.flight import flight_keys
from paradize.export.heights import at_least, smoothstep, terrain_heights, under_water
from paradize.export.pictures import gloss_png, ground_light, normal_png, occlusion_png, sky_pngs
from paradize.export.scene import sky_turn
from paradize.export.shapes import SKY_FACES, joined, level_quad, mirrored
from paradize.formats.glb.bundle import Bundle
from paradize.formats.png import decode_png
from paradize.scene.flight import plan_flight
from paradize.scene.settings import EyePoint, Flight, TargetPoint
from tests.pipeline.shapes import cube, grid, sphere

F64 = npt.NDArray[np.float64]


def turned(quaternion: npt.ArrayLike, vector: npt.ArrayLike) -> F64:
    """v + 2 w (q x v) + 2 q x (q x v)."""
    q, v = np.asarray(quaternion, float), np.asarray(vector, float)
    across = 2.0 * np.cross(q[:3], v)
    return np.asarray(v + q[3] * across + np.cross(q[:3], across))


def rolling_flight() -> Flight:
    places = ((9, 2, 0), (0, 2, 9), (-9, 6, 0), (0, 2, -9))
    rolls = (0.0, 30.0, -20.0, 60.0)
    eye = tuple(EyePoint(position=p, roll_deg=r) for p, r in zip(places, rolls, strict=True))
    target = tuple(TargetPoint(position=p) for p in ((0, 2, 0), (1, 1, 0), (0, 5, 1), (0, 2, -1)))
    return Flight(duration_s=2.0, eye=eye, target=target)


def test_the_camera_s_keys_look_ahead_and_roll_as_the_player_does() -> None:
    """-Z to the target; a roll lifts the right-hand side by its sine (player/scene/flight.cpp)."""
    flight = plan_flight(rolling_flight())
    keys = flight_keys(flight.as_json())
    for t, place, turn in zip(keys.times_s, keys.places, keys.turns, strict=True):
        eye, target, roll = flight.pose(float(t))
        ahead = np.subtract(target, eye) / math.dist(eye, target)
        assert np.allclose(place, eye, atol=1e-5)
        assert np.allclose(turned(turn, [0, 0, -1]), ahead, atol=1e-5)
        level = math.hypot(ahead[0], ahead[2])
        assert turned(turn, [1, 0, 0])[1] == pytest.approx(math.sin(roll) * level, abs=1e-5)
        assert turned(turn, [0, 1, 0])[1] == pytest.approx(math.cos(roll) * level, abs=1e-5)


def standing(eye: tuple[float, ...], target: tuple[float, ...]) -> dict[str, Any]:
    """The flight of a scene.json that never moves."""
    tree = plan_flight(rolling_flight()).as_json()
    for segment in tree["segments"]:
        segment["eye"] = [[x, 0.0, 0.0, 0.0] for x in eye]
        segment["target"] = [[x, 0.0, 0.0, 0.0] for x in target]
        segment["roll"] = [0.0] * 4
    return tree


@pytest.mark.parametrize(
    ("target", "ahead", "up"),
    [
        ((1, 0, 3), (0, -1, 0), (0, 0, -1)),
        ((1, 9, 3), (0, 1, 0), (0, 0, 1)),
        ((1, 2, 3), (0, 0, -1), (0, 1, 0)),
    ],
)
def test_a_camera_that_looks_straight_up_or_down_or_nowhere_stands_as_the_player_s(
    target: tuple[float, ...], ahead: tuple[float, ...], up: tuple[float, ...]
) -> None:
    turn = flight_keys(standing((1.0, 2.0, 3.0), target)).turns[7]
    assert turned(turn, [0, 0, -1]) == pytest.approx(ahead, abs=1e-6)
    assert turned(turn, [0, 1, 0]) == pytest.approx(up, abs=1e-6)


def test_keys_of_a_flight_far_from_the_origin_are_as_exact_as_those_of_one_near_it() -> None:
    near = plan_flight(rolling_flight()).as_json()
    far = json.loads(json.dumps(near))
    for segment in far["segments"]:
        for points in (segment["eye"], segment["target"]):
            points[0][0] += 1e6
            points[2][0] -= 3e5
    keys, moved = flight_keys(near), flight_keys(far)
    assert keys.origin == (0.0, 0.0, 0.0)
    assert moved.origin == pytest.approx((1e6, 4.0, -3e5), abs=1.5)
    shift = np.subtract(moved.origin, (1e6, 0.0, -3e5))
    assert np.allclose(moved.places + shift, keys.places, atol=1e-5)
    assert moved.errors == pytest.approx(keys.errors, rel=0.01)


def test_errors_of_the_keys_are_those_between_them() -> None:
    """Four moments between two keys: places on straight lines, the largest miss and the one of 99 in 100.
    Between two keys a viewer turns evenly about one axis."""
    flight = plan_flight(rolling_flight())
    keys = flight_keys(flight.as_json())
    assert len(keys.times_s) == 61, "thirty keys a second"
    assert (np.diff(keys.turns, axis=0) ** 2).sum(axis=1).max() < 0.1, "no key takes the long way round"
    times = np.linspace(0.0, 2.0, len(keys.times_s))
    off = []
    for k, share in ((k, share) for k in range(len(times) - 1) for share in (0.2, 0.4, 0.6, 0.8)):
        a, b = keys.turns[k : k + 2].astype(np.float64)
        way = math.acos(min(1.0, a @ b / math.sqrt((a @ a) * (b @ b))))
        shown = (math.sin((1 - share) * way) * a + math.sin(share * way) * b) / math.sin(way)
        eye, target, roll = flight.pose(times[k] + share * (times[k + 1] - times[k]))
        ahead = np.subtract(target, eye) / math.dist(eye, target)
        right = np.cross(ahead, [0, 1, 0]) / np.linalg.norm(np.cross(ahead, [0, 1, 0]))
        up = math.cos(roll) * np.cross(right, ahead) - math.sin(roll) * right
        true = np.stack([np.cross(ahead, up), up, -ahead])
        trace = sum(true[i] @ turned(shown, axis) for i, axis in enumerate(np.eye(3)))
        off.append(math.degrees(math.acos(min(1.0, (trace - 1) / 2))))
    assert keys.errors["path_export_deg_max"] == pytest.approx(max(off), rel=0.01)
    eyes = np.array([flight.view(float(t))[0] for t in times])
    apart = []
    for k, share in ((k, share) for k in range(len(times) - 1) for share in (0.2, 0.4, 0.6, 0.8)):
        t = times[k] + share * (times[k + 1] - times[k])
        apart.append(math.dist(eyes[k] + share * (eyes[k + 1] - eyes[k]), flight.view(float(t))[0]))
    apart.sort()
    assert keys.errors["path_export_m_max"] == pytest.approx(apart[-1], rel=1e-4)
    at = int(0.99 * (len(apart) - 1))
    low, high = apart[at] * (1 - 1e-5), apart[at + 1] * (1 + 1e-5)
    assert low <= keys.errors["path_export_m_p99"] <= high < apart[-1]
    assert 0.0 < keys.errors["path_export_deg_p99"] <= keys.errors["path_export_deg_max"]


def test_the_sky_s_faces_lie_as_cube_maps_do() -> None:
    """OpenGL 3.3, table 3.19: what s and t of a face's image are along its axes, t down."""
    rows = {
        "+x": lambda s, t: (1, -t, -s),
        "-x": lambda s, t: (-1, -t, s),
        "+y": lambda s, t: (s, 1, t),
        "-y": lambda s, t: (s, -1, -t),
        "+z": lambda s, t: (s, -t, 1),
        "-z": lambda s, t: (-s, -t, -1),
    }
    assert list(SKY_FACES) == list(rows)
    for face, way in rows.items():
        right, down, ahead = (np.array(axis) for axis in SKY_FACES[face])
        for s, t in ((-0.5, 0.25), (0.75, -1.0)):
            assert np.array_equal(ahead + s * right + t * down, way(s, t)), face


def test_a_sky_is_turned_to_where_its_light_stands_at_the_poster() -> None:
    sun, moon = {"azimuth_rad": 2.0, "intensity": 3.0}, {"azimuth_rad": 1.0, "intensity": 0.0}
    key = {"at_s": 5.0, "sun": sun, "moon": moon, "cubemap_azimuth_rad": 2.0 - math.pi / 2}
    other = key | {"at_s": 9.0, "cubemap_azimuth_rad": 0.0}
    north, east = np.array([0.0, 0.0, -1.0]), np.array([1.0, 0.0, 0.0])
    turn = sky_turn({"poster_s": 6.0, "daytime": {"keys": [other, key]}})
    assert turn @ north == pytest.approx(east, abs=1e-6)
    assert np.array_equal(sky_turn({"daytime": None}), np.eye(3))


def test_water_takes_light_on_the_way_down_and_up_again() -> None:
    water = {"level_m": 1.0, "absorption_per_m": [0.4, 0.1, 0.0], "deep_color": [0.1, 0.2, 0.3]}
    light = np.full((1, 2, 3), 0.5, np.float32)
    found = under_water(light, np.array([[-1.5, 1.5]], np.float32), water)
    share = np.exp(-np.array([0.4, 0.1, 0.0]) * 5.0)  # two and a half metres, twice
    assert found[0, 0] == pytest.approx(0.5 * share + np.array([0.1, 0.2, 0.3]) * (1.0 - share), rel=1e-6)
    assert np.array_equal(found[0, 1], light[0, 1])
    assert smoothstep(np.array([0.0, 1.0, 1.5, 2.0, 3.0], np.float32), 1.0, 2.0).tolist() == [0, 0, 0.5, 1, 1]
    assert smoothstep(np.array([0.5, 1.5], np.float32), 1.0, 1.0).tolist() == [0, 1], "a step"


def test_patches_give_the_ground_its_heights_and_what_none_covers_the_lowest() -> None:
    """The first patch is the left half of the ground, 2 m high; the last the upper left quarter, -3 m."""
    patches = []
    for height, corner in ((2.0, (0.5, 1.0)), (-3.0, (0.5, 0.5))):
        mesh = level_quad(height, 1.0)
        assert mesh.uvs is not None
        patches.append(replace(mesh, uvs1=mesh.uvs * np.array(corner, np.float32)))
    found = terrain_heights(patches, (4, 4))
    assert found.tolist() == [[-3, -3, -3, -3]] * 2 + [[2, 2, -3, -3]] * 2
    least, _ = at_least((1, 1))
    assert (at_least((9000, 1)), at_least((1, 8000))) == ((9000, least), (least, 8000))


def test_the_sky_s_faces_are_shown_with_exposure_and_the_player_s_tone(tmp_path: Path) -> None:
    """Number by number as shaders/lib/tonemap.glsl: a toe, a straight part and a shoulder."""
    light = np.array([0.0, 0.05, 0.15, 0.25, 0.5, 2.0])
    texels = np.ones((6, 1, 1, 4), np.float16)
    texels[..., :3] = light[:, None, None, None] / 2.0
    path = tmp_path / "face.png"
    for x, png in zip(light, sky_pngs(Texture("RGBA16_SFLOAT", 1, 1, (texels.tobytes(),)), 2.0), strict=True):
        near = min(x / 0.22, 1.0)
        toe = 1.0 - near * near * (3.0 - 2.0 * near)
        shown = 0.22 * (x / 0.22) ** 1.33 * toe + x * (1.0 - toe)
        if x >= 0.532:
            shown = 1.0 - 0.468 * math.exp(-(x - 0.532) / 0.468)
        path.write_bytes(png)
        code = 12.92 * shown if shown <= 0.0031308 else 1.055 * shown ** (1 / 2.4) - 0.055
        assert np.abs(decode_png(path)[0, 0] / 255.0 - code).max() < 0.51 / 255.0, x


def test_the_ground_s_picture_repeats_sand_and_lays_the_effect_once() -> None:
    """Linear light; a texel of the picture for each of the sand's, twice along x and once along z."""
    sand = np.linspace(0.2, 0.9, 4 * 8 * 3, dtype=np.float32).reshape(4, 8, 3)
    effect = np.linspace(0.9, 0.1, 4 * 16 * 3, dtype=np.float32).reshape(4, 16, 3)
    tiled = np.concatenate([sand, sand], axis=1)
    for share, expected in ((1.0, tiled), (0.0, effect), (0.25, 0.25 * tiled + 0.75 * effect)):
        found = ground_light(sand, effect, np.full((4, 16), share, np.float32), (2.0, 1.0))
        assert np.allclose(found, expected, atol=1e-6)
    alone = ground_light(sand, None, np.ones((8, 16), np.float32), (2.0, 1.0))
    between = 0.75 * tiled + 0.25 * np.roll(tiled, -1, axis=0)  # of rows twice as fine, and round the edge
    assert np.allclose(alone[1::2], between, atol=1e-6)
    plain = np.full((5, 6, 3), 0.25, np.float32)  # an odd number of rows is not halved
    assert np.allclose(ground_light(plain, None, np.ones((2, 2), np.float32), (1.0, 1.0)), 0.25)


def test_gloss_and_normals_stand_in_the_channels_that_gltf_reads(tmp_path: Path) -> None:
    """Roughness in green, metal in blue, specular strength in alpha; normals as 2 v / 255 - 1."""
    path = tmp_path / "a.png"
    path.write_bytes(gloss_png(Texture("RG8_UNORM", 2, 1, (bytes([51, 204, 255, 0]),))))
    assert decode_png(path)[0, :, 1:].tolist() == [[51, 255, 51], [255, 255, 255]]
    path.write_bytes(normal_png(Texture("RG8_SNORM", 1, 1, (bytes([76, (-51) % 256]),))))
    x, y = 76 / 127, -51 / 127
    vector = decode_png(path)[0, 0].astype(float) * 2 / 255 - 1
    assert vector == pytest.approx([x, y, math.sqrt(1 - x * x - y * y)], abs=0.005)


def test_metalness_stands_beside_roughness_and_occlusion_in_a_picture_of_its_own(tmp_path: Path) -> None:
    """The smaller map's nearest texels count; without gloss roughness and specular are their factors'."""
    path = tmp_path / "a.png"
    gloss = Texture("RG8_UNORM", 4, 2, (bytes([51, 204] * 4 + [0, 0] * 4),))
    hidden = Texture("RG8_UNORM", 2, 1, (bytes([102, 30, 153, 90]),))
    path.write_bytes(gloss_png(gloss, hidden))
    assert decode_png(path)[:, :, 2].tolist() == [[30, 30, 90, 90]] * 2
    assert decode_png(path)[:, 0, 1].tolist() == [51, 255]
    path.write_bytes(gloss_png(None, hidden))
    assert decode_png(path)[0].tolist() == [[255, 255, 30, 255], [255, 255, 90, 255]]
    path.write_bytes(gloss_png(gloss, smoothness=0.5))
    assert decode_png(path)[:, 0, 1].tolist() == [153, 255]  # 1 - 0.5 * 204 / 255
    path.write_bytes(occlusion_png(hidden))
    assert decode_png(path)[0, :, 0].tolist() == [102, 153]
    path.write_bytes(gloss_png(gloss, Texture("R8_UNORM", 1, 1, (bytes([7]),))))
    assert decode_png(path)[0, 0].tolist() == [255, 51, 255, 51], "occlusion alone has no metalness"


def test_joined_patches_keep_every_triangle_where_it_was() -> None:
    plain = [
        replace(mesh, uvs1=2 * mesh.uvs) for mesh in (grid(3), sphere(4), grid(2)) if mesh.uvs is not None
    ]
    framed = [replace(mesh, tangents=np.ones((len(mesh.positions), 4), np.float32)) for mesh in plain]
    for meshes in (plain, framed):  # a terrain without relief has no tangents
        found = joined(meshes)
        corners = np.concatenate([mesh.positions[mesh.triangles] for mesh in meshes])
        assert np.array_equal(found.positions[found.triangles], corners)
        assert (found.tangents is None) == (meshes is plain)
        for attribute in ("uvs", "uvs1"):
            values = [getattr(mesh, attribute)[mesh.triangles] for mesh in meshes]
            assert np.array_equal(getattr(found, attribute)[found.triangles], np.concatenate(values))


def test_a_level_square_faces_up_and_its_image_lies_as_a_terrain_s() -> None:
    """Right is +X, the bottom +Z; so T = +X, B = -Z."""
    square = level_quad(3.0, 10.0, 4.0)
    assert square.normals is not None and square.tangents is not None and square.uvs is not None
    assert square.normals.tolist() == [[0, 1, 0]] * 4
    assert square.tangents.tolist() == [[1, 0, 0, 1]] * 4
    assert np.allclose(square.uvs, (square.positions[:, [0, 2]] / 10 + 0.5) * 4)
    assert square.positions[:, 1].tolist() == [3.0] * 4
    assert np.ptp(square.positions[:, [0, 2]], axis=0).tolist() == [10.0, 10.0]
    a, b, c = square.positions[square.triangles[0]].astype(float)
    assert np.cross(b - a, c - a)[1] > 0.0


def test_a_mirrored_mesh_is_the_mesh_in_a_mirror() -> None:
    """Outsides stay outside, and bitangents are mirrored as all else is."""
    mesh = sphere(6)
    tangents = np.random.default_rng(2).normal(size=(len(mesh.positions), 4)).astype(np.float32)
    tangents[:, 3] = np.where(tangents[:, 3] < 0, -1, 1)
    mesh = replace(mesh, tangents=tangents)
    found = mirrored(mesh)
    assert mesh.normals is not None and found.normals is not None and found.tangents is not None
    mirror = np.array([-1, 1, 1], np.float32)
    assert np.array_equal(found.positions, mesh.positions * mirror)
    before, after = (one.positions[one.triangles].astype(np.float64) for one in (mesh, found))
    outside = [np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0]) for c in (before, after)]
    assert np.allclose(outside[1], outside[0] * mirror)
    bitangents = [
        one[:, 3:] * np.cross(normals, one[:, :3])
        for one, normals in ((tangents, mesh.normals), (found.tangents, found.normals))
    ]
    assert np.array_equal(bitangents[1], bitangents[0] * mirror)
    bare = mirrored(replace(mesh, normals=None, tangents=None))
    assert bare.normals is None and bare.tangents is None


def test_vertex_colours_reach_only_materials_that_they_multiply() -> None:
    colors = np.full((len(cube().positions), 4), 0.5, np.float32)
    mesh = replace(cube(), colors=colors, groups=(Group("a", "wood", 0, 6), Group("b", "lamp", 6, 6)))
    bundle = Bundle("b")
    used = {name: bundle.material(name) for name in ("wood", "lamp")}
    bundle.mesh("m", mesh, used, {"lamp"})
    wood, lamp = bundle.meshes[0]["primitives"]
    assert "COLOR_0" in wood["attributes"] and "COLOR_0" not in lamp["attributes"]
    assert wood["attributes"]["POSITION"] == lamp["attributes"]["POSITION"]


def test_primitives_of_a_bundle_are_the_runs_of_their_materials_and_textures_wrap_as_asked() -> None:
    mesh = replace(
        cube(), groups=(Group("a", "wood", 0, 3), Group("b", "tin", 3, 4), Group("c", "wood", 7, 5))
    )
    bundle = Bundle("b")
    wood, tin = (bundle.material(name) for name in ("wood", "tin"))
    bundle.mesh("m", mesh, {"wood": wood, "tin": tin})
    bundle.texture("tiled", b"png")
    bundle.texture("edged", b"png", ("clamp", "mirror"), nearest=True)
    glb = bundle.encoded({})
    length = struct.unpack_from("<I", glb, 12)[0]
    tree, binary = json.loads(glb[20 : 20 + length]), glb[28 + length :]
    found = []
    for primitive in tree["meshes"][0]["primitives"]:
        accessor = tree["accessors"][primitive["indices"]]
        start = tree["bufferViews"][accessor["bufferView"]]["byteOffset"] + accessor.get("byteOffset", 0)
        assert accessor["componentType"] == 5123
        found.append(np.frombuffer(binary, "<u2", accessor["count"], start))
    assert np.array_equal(np.concatenate(found), mesh.triangles.ravel())
    used = [primitive["material"] for primitive in tree["meshes"][0]["primitives"]]
    assert (used, [len(corners) for corners in found]) == ([wood, tin, wood], [9, 12, 15])
    keys = "wrapS", "wrapT", "magFilter"
    samplers = [[tree["samplers"][one["sampler"]][key] for key in keys] for one in tree["textures"]]
    # REPEAT and LINEAR; CLAMP_TO_EDGE, MIRRORED_REPEAT and NEAREST
    assert samplers == [[10497, 10497, 9729], [33071, 33648, 9728]]
