"""Materials and instances look as the equations of light say, pixel by pixel.

The eye stands on +Z and looks at the origin. Without the pass `post` a pixel is linear light. Without a sky,
0.75 of the ambient light reaches a surface that faces the eye.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from math import cos, pi, sin, tan
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio
import pytest

from paradize.data import Group, Lod, Mesh
from paradize.formats.glb.encode import encode_glb
from tests.player.synthetic import identity, instance, material, texture, write_scene
from tests.sweeps import sample, sweep

F64 = npt.NDArray[np.float64]
WIDTH, HEIGHT, FOV_RAD, AWAY_M = 96, 54, 0.9, 5.0
BLACK = {"color": [0.0, 0.0, 0.0], "specular": 0.0}
WHITE = {"specular": 0.0}
STEP = 1.5 / 255.0  # of a stored pixel, with rounding
Render = Callable[..., F64]


def quad(normal: tuple[float, float, float] = (0.0, 0.0, 1.0), size: float = 2.0) -> Mesh:
    """A square round the origin with T = +X, one vertex colour and one material, `m`."""
    n = np.array(normal) / np.linalg.norm(normal)
    t = np.array([1.0, 0.0, 0.0])
    b = np.cross(n, t)
    corners = [(-1, 1), (1, 1), (-1, -1), (1, -1)]
    return Mesh(
        np.array([0.5 * size * (x * t + y * b) for x, y in corners], np.float32),
        np.array([[0, 2, 1], [1, 2, 3]], np.uint32),
        np.tile(n, (4, 1)).astype(np.float32),
        np.tile([*t, 1.0], (4, 1)).astype(np.float32),
        np.array([[(x + 1) / 2, (1 - y) / 2] for x, y in corners], np.float32),
        colors=np.tile([0.5, 0.25, 1.0, 0.5], (4, 1)).astype(np.float32),
        groups=(Group("m", "m", 0, 2),),
    )


def at_depth(mesh: Mesh, z: float) -> Mesh:
    return replace(mesh, positions=mesh.positions + np.array([0, 0, z], np.float32))


def sphere(radius: float) -> Mesh:
    """Of 64 x 128 quads, without a seam of normals."""
    u, v = np.meshgrid(np.linspace(0, 1, 129), np.linspace(0, 1, 65))
    a, b = 2 * pi * u.ravel(), pi * v.ravel()
    normals = np.stack([np.sin(b) * np.cos(a), np.cos(b), -np.sin(b) * np.sin(a)], axis=1)
    first = (np.arange(64)[:, None] * 129 + np.arange(128)).ravel()
    faces = np.concatenate(
        [
            np.stack([first, first + 129, first + 1], 1),
            np.stack([first + 1, first + 129, first + 130], 1),
        ]
    )
    return Mesh(
        (radius * normals).astype(np.float32),
        faces.astype(np.uint32),
        normals.astype(np.float32),
        groups=(Group("m", "m", 0, len(faces)),),
    )


def thing(name: str, materials: dict[str, Any], *stands: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {
        "name": name,
        "views": ["camera", "shadow", "reflection", "refraction"],
        "mesh": f"{name}_mesh",
        "center": [0.0, 0.0, 0.0],
        "radius_m": 20.0,
        "lods": [{"node": "lod0", "error_m": 0.0}],
        "materials": materials,
        "instances": list(stands) or [instance([0.0, 0.0, 0.0])],
    } | changes


@pytest.fixture
def render(player: Callable[..., Any], tmp_path: Path) -> Render:
    """(h, w, 3) linear light of things with their meshes and textures. sun: direction and intensity."""

    def run(
        things: list[dict[str, Any]],
        meshes: dict[str, Mesh],
        textures: dict[str, bytes] | None = None,
        *,
        sun: tuple[list[float], float] = ([0.0, 0.0, 1.0], 0.0),
        ambient: float = 0.0,
        report: dict[str, Any] | None = None,
        options: tuple[str, ...] = ("--disable", "post"),
        **changes: Any,
    ) -> F64:
        folder = write_scene(tmp_path / "scene", bare=True)
        scene = json.loads((folder / "scene.json").read_text())
        plain = scene["artifacts"].pop("box_color") | {"file": "", "kind": ""}
        scene["artifacts"] = {}
        files = {f"{name}_mesh.glb": encode_glb([Lod(mesh, 0.0, 0.0)], name) for name, mesh in meshes.items()}
        files |= {f"{name}.ktx2": data for name, data in (textures or {}).items()}
        for file, data in files.items():
            (folder / file).write_bytes(data)
            kind = "mesh" if file.endswith("glb") else "texture"
            entry = plain | {"file": file, "kind": kind, **identity(data)}
            scene["artifacts"][file.rpartition(".")[0]] = entry
        still = [[0.0] * 4] * 2 + [[AWAY_M, 0.0, 0.0, 0.0]]
        for segment in scene["flight"]["segments"]:
            segment |= {"eye": still, "target": [[0.0] * 4] * 3}
        scene |= {"objects": things, "streaming": sorted(scene["artifacts"])}
        scene["sun"] |= {"direction": sun[0], "color": [1.0, 1.0, 1.0], "intensity": sun[1]}
        scene["ambient"] = {"color": [1.0, 1.0, 1.0], "intensity": ambient}
        scene["fog"]["density_per_m"] = 0.0
        scene |= changes
        (folder / "scene.json").write_text(json.dumps(scene))
        out = tmp_path / "a.png"
        result = player(
            folder, "--size", f"{WIDTH}x{HEIGHT}", "--screenshot", out, *options, "--check-finite", "--debug",
            "--json",
        )  # fmt: skip
        assert result.returncode == 0, result.stderr
        if report is not None:
            report |= json.loads(result.stdout)
        return np.asarray(oiio.ImageBuf(str(out)).get_pixels(oiio.UINT8), np.float64)[..., :3] / 255.0

    return run


def middle(picture: F64) -> F64:
    return picture[HEIGHT // 2 - 2 : HEIGHT // 2 + 2, WIDTH // 2 - 2 : WIDTH // 2 + 2].mean(axis=(0, 1))


def beside(
    render: Render,
    surfaces: Sequence[tuple[dict[str, Any], Mesh]],
    textures: dict[str, bytes] | None = None,
    **light: Any,
) -> list[F64]:
    """The middles of up to six squares side by side, of a material and a mesh of up to 1.2 m each."""
    across = 1.4 * (np.arange(len(surfaces)) - 0.5 * (len(surfaces) - 1))
    meshes = {f"t{k}": mesh for k, (_, mesh) in enumerate(surfaces)}
    things = [
        thing(name, {"m": one}, instance([float(x), 0.0, 0.0]))
        for name, (one, _), x in zip(meshes, surfaces, across, strict=True)
    ]
    picture = render(things, meshes, textures, **light)
    pixels_a_metre = HEIGHT / (2.0 * AWAY_M * tan(0.5 * FOV_RAD))
    columns = np.rint(WIDTH / 2 + across * pixels_a_metre).astype(int)
    return [picture[HEIGHT // 2 - 2 : HEIGHT // 2 + 2, x - 2 : x + 2].mean(axis=(0, 1)) for x in columns]


def texel(*values: int, fmt: str = "RGBA8_SRGB", kind: Any = np.uint8) -> bytes:
    return texture(fmt, np.full((4, 4, len(values)), values, kind))


def glow(*color: float, **changes: Any) -> dict[str, Any]:
    return material(**(BLACK | {"emission": list(color)} | changes))


def test_emission_is_its_colour_times_its_map_in_linear_light(render: Render) -> None:
    one = glow(0.2, 0.4, 0.6, emission_map="glow")
    seen = middle(render([thing("a", {"m": one})], {"a": quad()}, {"glow": texel(188, 255, 188, 255)}))
    half = ((188 / 255 + 0.055) / 1.055) ** 2.4
    assert seen == pytest.approx([0.2 * half, 0.4, 0.6 * half], abs=STEP)


def test_maps_on_second_coordinates_multiply_those_on_first_ones(render: Render) -> None:
    """Each map is white on the left and dark on the right; second coordinates show the middle their left or
    their right end alone."""
    row = np.array([[255, 255, 0, 0]], np.uint8).repeat(4, axis=0)
    maps = {
        "one": texel(255, 255, fmt="RG8_UNORM"),
        "glow": texture("RGBA8_UNORM", np.repeat(row[:, :, None], 4, axis=2)),
        "metal": texel(255, 0, fmt="RG8_UNORM"),
        "shade": texture("R8_UNORM", np.maximum(row, 64)[:, :, None]),
        "bumps": texture("RG8_SNORM", np.stack([row // 255 * 76, row * 0], axis=2).astype(np.int8)),
    }
    none = dict.fromkeys(("normal", "gloss", "occlusion", "emission"))

    def shown(at: float, one: dict[str, Any], **maps_of: str) -> tuple[dict[str, Any], Mesh]:
        square = quad(size=1.2)
        assert square.uvs is not None
        second = {"maps": none | maps_of, "wrap": ["clamp", "clamp"]}
        return one | {"second": second}, replace(square, uvs1=np.full_like(square.uvs, at))

    bright = glow(0.5, 0.25, 0.125)
    left, right = beside(render, [shown(at, bright, emission="glow") for at in (0.25, 0.75)], maps)
    assert left == pytest.approx([0.5, 0.25, 0.125], abs=STEP)
    assert right == pytest.approx([0.0] * 3, abs=STEP)
    # The first occlusion map takes all metalness away, the second one light.
    matte = material(**WHITE, color=[0.8] * 3, metalness=1.0, occlusion="metal")
    steel = material(**WHITE, color=[0.8] * 3, metalness=1.0)
    surfaces = [
        shown(0.25, matte, occlusion="shade"),
        shown(0.75, matte, occlusion="shade"),
        shown(0.25, steel, occlusion="metal"),
    ]
    bare, shaded, dull = beside(render, surfaces, maps, ambient=1.0)
    assert bare == pytest.approx([0.6] * 3, abs=STEP)
    assert shaded == pytest.approx([0.6 * 64 / 255] * 3, abs=STEP)
    assert dull == pytest.approx([0.6] * 3, abs=STEP)
    # Metal is compared where it shines alike.
    metals = [shown(0.25, steel), shown(0.25, steel, occlusion="shade")]
    whole, same = (beside(render, [metal], maps, ambient=1.0)[0] for metal in metals)
    assert same == pytest.approx(whole, abs=STEP)
    x = 76 / 127
    sun = ([x, 0.0, (1 - x * x) ** 0.5], 0.9 * pi)
    bumpy = material(**WHITE)
    left, right = beside(render, [shown(at, bumpy, normal="bumps") for at in (0.25, 0.75)], maps, sun=sun)
    assert left == pytest.approx([0.9] * 3, abs=STEP)
    assert right == pytest.approx([0.9 * sun[0][2]] * 3, abs=STEP)


@pytest.mark.parametrize("mirrored", sweep([0, 1], test=[0]))
def test_relief_follows_first_coordinates_where_normals_lie_on_mirrored_second_ones(
    render: Render, mirrored: int
) -> None:
    """A slanted square whose picture is pushed aside by a flat relief; all its normals point straight out."""
    row = np.linspace(0, 255, 64).astype(np.uint8)
    picture = np.stack([row[None].repeat(64, 0), row[:, None].repeat(64, 1), row[None].repeat(64, 0)], axis=2)
    alpha = np.full((64, 64, 1), 255, np.uint8)
    maps = {
        "glow": texture("RGBA8_UNORM", np.concatenate([picture, alpha], axis=2)),
        "white": texel(255, fmt="R8_UNORM"),
        "flat": texture("RG8_SNORM", np.zeros((4, 4, 2), np.int8)),
    }
    one = glow(1.0, 1.0, 1.0, emission_map="glow", height="white", parallax_scale=0.3, parallax_bias=0.1)
    square = quad(size=3.0)
    assert square.uvs is not None and square.tangents is not None
    uvs, sides = square.uvs.copy(), square.tangents * np.float32(-1.0)
    uvs[:, mirrored] = 1.0 - uvs[:, mirrored]
    if mirrored == 1:
        sides[:, :3] *= -1.0
    turned = replace(square, uvs1=uvs, tangents=sides)
    none = dict.fromkeys(("normal", "gloss", "occlusion", "emission"))
    second = one | {"second": {"maps": none | {"normal": "flat"}, "wrap": ["clamp", "clamp"]}}
    stand = instance([0.0, 0.0, 0.0], yaw_rad=0.7)
    plain, seen, still = (
        render([thing("a", {"m": of}, stand)], {"a": mesh}, maps)
        for of, mesh in ((one, square), (second, turned), (one | {"parallax_scale": 0.0}, square))
    )
    assert np.abs(plain - still).max() > 20 * STEP
    assert np.abs(seen - plain).max() <= 2 * STEP


def wrapped(index: npt.NDArray[np.int64], way: str) -> npt.NDArray[np.int64]:
    """Texels of a row of four, as OpenGL 3.3 (table 3.18) names them."""
    if way == "clamp":
        return np.clip(index, 0, 3)
    if way == "repeat":
        return index % 4
    return np.minimum(index % 8, 7 - index % 8)


@pytest.mark.parametrize(
    ("ways", "nearest"),
    sweep(
        product([("repeat", "clamp"), ("clamp", "mirror"), ("mirror", "repeat")], [False, True]),
        test=[(("clamp", "mirror"), True), (("mirror", "repeat"), False)],
    ),
)
def test_beyond_a_maps_edges_lies_what_its_material_says(
    render: Render, ways: tuple[str, str], nearest: bool
) -> None:
    """A square of 4 m with texture coordinates from -1 to 2. Each texel of the map is its own colour."""
    texels = np.zeros((4, 4, 4), np.uint8)
    texels[..., 0], texels[..., 1] = np.arange(0, 256, 85), np.arange(0, 256, 85)[:, None]
    texels[..., 3] = 255
    square = quad(size=4.0)
    assert square.uvs is not None
    square = replace(square, uvs=3.0 * square.uvs - 1.0)
    one = glow(1.0, 1.0, 1.0, emission_map="glow", wrap=list(ways), nearest=nearest)
    seen = render([thing("a", {"m": one})], {"a": square}, {"glow": texture("RGBA8_UNORM", texels)})
    step = 2.0 * AWAY_M * tan(0.5 * FOV_RAD) / HEIGHT
    shown = np.arange(-20, 20)
    at = 4.0 * (3.0 * ((shown + 0.5) * step / 4.0 + 0.5) - 1.0)  # in texels
    for channel, way in enumerate(ways):
        if nearest:
            expected = wrapped(np.floor(at).astype(np.int64), way) / 3.0
            known = np.abs(at - np.rint(at)) > 0.05
        else:
            left = np.floor(at - 0.5).astype(np.int64)
            share = at - 0.5 - left
            expected = ((1.0 - share) * wrapped(left, way) + share * wrapped(left + 1, way)) / 3.0
            known = np.ones(len(at), np.bool_)
        line = (
            seen[HEIGHT // 2, WIDTH // 2 + shown, 0]
            if channel == 0
            else seen[HEIGHT // 2 + shown, WIDTH // 2, 1]
        )
        assert np.abs(line - expected)[known].max() <= 2.0 * STEP, (way, line, expected)


def test_of_materials_with_one_map_each_has_its_own_filter_and_wrap(render: Render) -> None:
    """Half of the map glows, and each square shows it twice. Only a linear filter has values in between."""
    texels = np.zeros((4, 4, 4), np.uint8)
    texels[:, 2:] = 255
    square = quad(size=1.4)
    assert square.uvs is not None
    ways = [("repeat", False), ("repeat", True), ("clamp", True), ("mirror", True)]
    across = np.array([-3.0, -1.0, 1.0, 3.0])
    things = []
    for k, ((wrap, nearest), x) in enumerate(zip(ways, across, strict=True)):
        one = glow(1.0, 1.0, 1.0, emission_map="half", wrap=[wrap, "repeat"], nearest=nearest)
        things.append(thing(f"t{k}", {"m": one}, instance([float(x), 0.0, 0.0]), mesh="a_mesh"))
    mesh = replace(square, uvs=2.0 * square.uvs)
    row = render(things, {"a": mesh}, {"half": texture("RGBA8_SRGB", texels)})[HEIGHT // 2, :, 0]
    pixels_a_metre = HEIGHT / (2.0 * AWAY_M * tan(0.5 * FOV_RAD))
    inner = (across * pixels_a_metre + WIDTH / 2).astype(int)[:, None] + np.arange(-6, 7)
    between = ((row[inner] > 0.1) & (row[inner] < 0.9)).sum(axis=1)
    assert between[0] >= 3 and not between[1:].any()
    quarters = (across[:, None] + 1.4 * np.array([-0.375, -0.125, 0.125, 0.375])) * pixels_a_metre + WIDTH / 2
    assert row[quarters[1:].astype(int)].tolist() == [[0, 1, 0, 1], [0, 1, 1, 1], [0, 1, 1, 0]]


def over(front: list[float], alpha: float, back: F64) -> F64:
    return alpha * np.array(front) + (1 - alpha) * back


GREEN, BLUE, RED = [0.0, 0.9, 0.1], [0.1, 0.0, 0.8], [0.7, 0.1, 0.0]
BLENDED = over(GREEN, 0.5, over(BLUE, 0.25, np.array(RED)))


@pytest.mark.parametrize("front_first", [True, False])
def test_blended_objects_mix_back_to_front_in_whatever_order_they_stand(
    render: Render, front_first: bool
) -> None:
    things = [
        thing("a", {"m": glow(*GREEN, alpha_mode="blend", opacity=0.5)}, instance([0.0, 0.0, 1.0])),
        thing("b", {"m": glow(*BLUE, alpha_mode="blend", opacity=0.25)}),
        thing("c", {"m": glow(*RED)}, instance([0.0, 0.0, -1.0])),
    ]
    things = things if front_first else things[::-1]
    seen = middle(render(things, {name: quad() for name in "abc"}))
    assert seen == pytest.approx(BLENDED, abs=STEP)


@pytest.mark.parametrize("front_first", [True, False])
def test_blended_materials_of_one_mesh_mix_back_to_front(render: Render, front_first: bool) -> None:
    parts = [at_depth(quad(), z) for z in (1.0, 0.0, -1.0)]
    names = ["front", "between", "behind"]
    if not front_first:
        parts, names = parts[::-1], names[::-1]
    mesh = Mesh(
        np.concatenate([part.positions for part in parts]),
        np.concatenate([part.triangles + np.uint32(4 * k) for k, part in enumerate(parts)]),
        np.concatenate([part.normals for part in parts if part.normals is not None]),
        groups=tuple(Group(name, name, 2 * k, 2) for k, name in enumerate(names)),
    )
    materials = {
        "front": glow(*GREEN, alpha_mode="blend", opacity=0.5),
        "between": glow(*BLUE, alpha_mode="blend", opacity=0.25),
        "behind": glow(*RED),
    }
    assert middle(render([thing("a", materials)], {"a": mesh})) == pytest.approx(BLENDED, abs=STEP)


@pytest.mark.parametrize(
    ("alpha", "front_first"),
    sweep(product([255, 102], [True, False]), test=[(255, False), (102, True)]),
)
def test_what_is_solid_of_a_blended_material_hides_what_lies_behind_whatever_the_order_of_triangles(
    render: Render, alpha: int, front_first: bool
) -> None:
    """As hair and skin that share a picture: nothing sorts the triangles of one material."""
    quads = [
        replace(at_depth(quad(), z), uvs=np.full((4, 2), [u, 0.5], np.float32))
        for z, u in ((1.0, 0.25), (-1.0, 0.75))
    ]
    quads = quads if front_first else quads[::-1]
    mesh = Mesh(
        np.concatenate([part.positions for part in quads]),
        np.concatenate([part.triangles + np.uint32(4 * k) for k, part in enumerate(quads)]),
        np.concatenate([part.normals for part in quads if part.normals is not None]),
        uvs=np.concatenate([part.uvs for part in quads if part.uvs is not None]),
        groups=(Group("m", "m", 0, 4),),
    )
    colors = np.array([[[0, 255, 0, alpha], [255, 0, 0, 255]]] * 2, np.uint8)
    one = glow(1.0, 1.0, 1.0, alpha_mode="blend", emission_map="colors", nearest=True)
    one["maps"]["color"] = "colors"
    seen = middle(render([thing("a", {"m": one})], {"a": mesh}, {"colors": texture("RGBA8_UNORM", colors)}))
    assert seen == pytest.approx(over([0.0, 1.0, 0.0], alpha / 255, np.array([1.0, 0.0, 0.0])), abs=STEP)


def test_blended_instances_mix_back_to_front(render: Render) -> None:
    stands = [instance([0.0, 0.0, z]) for z in (0.5, -1.0, 0.0)]
    one = thing("a", {"m": glow(0.8, 0.4, 0.2, alpha_mode="blend", opacity=0.5)}, *stands)
    seen = middle(render([one], {"a": quad()}))
    assert seen == pytest.approx(np.array([0.8, 0.4, 0.2]) * (1 - 0.5**3), abs=2 * STEP)


def test_what_stands_before_a_blended_surface_hides_it_and_opaque_ignores_alpha(render: Render) -> None:
    things = [
        thing("a", {"m": glow(0.0, 0.5, 0.0, alpha_mode="blend", opacity=0.5)}, instance([0.0, 0.0, -1.0])),
        thing("b", {"m": material("clear", color=[0.0] * 3, specular=0.0, emission=[0.5, 0.0, 0.0])}),
    ]
    seen = middle(render(things, {"a": quad(), "b": quad()}, {"clear": texel(255, 255, 255, 0)}))
    assert seen == pytest.approx([0.5, 0.0, 0.0], abs=STEP)


@pytest.mark.parametrize("cutoff, there", [(0.25, True), (0.35, False)])
def test_a_mask_keeps_what_has_at_least_the_cutoff(render: Render, cutoff: float, there: bool) -> None:
    """Alpha is 0.6 of the map times 0.5 of the opacity."""
    one = glow(0.5, 0.5, 0.5, alpha_mode="mask", alpha_cutoff=cutoff, opacity=0.5)
    one["maps"]["color"] = "holes"
    seen = middle(render([thing("a", {"m": one})], {"a": quad()}, {"holes": texel(255, 255, 255, 153)}))
    assert seen == pytest.approx([0.5 if there else 0.0] * 3, abs=STEP)


def test_vertex_colours_multiply_colour_and_alpha_where_the_material_says_so(render: Render) -> None:
    one = material(**WHITE, color=[0.8, 0.8, 0.8], vertex_colors=True)
    changes: list[dict[str, Any]] = [{}, {"alpha_mode": "blend"}, {"vertex_colors": False}]
    surfaces = [(one | change, quad(size=1.2)) for change in changes]
    solid, blend, without = beside(render, surfaces, sun=([0.0, 0.0, 1.0], pi))
    assert solid == pytest.approx([0.4, 0.2, 0.8], abs=STEP)
    assert blend == pytest.approx([0.2, 0.1, 0.4], abs=STEP)
    assert without == pytest.approx([0.8] * 3, abs=STEP)


def test_vertex_colours_multiply_what_an_unlit_material_gives_off(render: Render) -> None:
    one = glow(0.8, 0.8, 0.8, vertex_colors=True)
    unlit, lit = beside(render, [(one | {"unlit": unlit}, quad(size=1.2)) for unlit in (True, False)])
    assert unlit == pytest.approx([0.4, 0.2, 0.8], abs=STEP)
    assert lit == pytest.approx([0.8] * 3, abs=STEP)


def test_a_two_sided_surface_is_lit_from_behind_as_from_the_front(render: Render) -> None:
    one = material(**WHITE, color=[0.6] * 3, two_sided=True)
    back = thing("a", {"m": one}, instance([0.0, 0.0, 0.0], pi))
    lit = {"sun": ([0.0, 0.0, 1.0], pi)}
    assert middle(render([back], {"a": quad()}, **lit)) == pytest.approx([0.6] * 3, abs=STEP)
    back["materials"]["m"] |= {"two_sided": False}
    assert middle(render([back], {"a": quad()}, **lit)) == pytest.approx([0.0] * 3, abs=STEP)


def test_light_from_behind_passes_through_leaves_and_not_through_a_two_sided_grate(render: Render) -> None:
    one = material("leaf", **WHITE, color=[0.4] * 3, two_sided=True, alpha_mode="mask")
    lit = {"sun": ([0.0, 0.0, -1.0], pi)}
    grate, leaves = beside(
        render,
        [(one | {"translucency": share}, quad(size=1.2)) for share in (0.0, 0.5)],
        {"leaf": texel(255, 255, 255, 255)},
        **lit,
    )
    assert grate == pytest.approx([0.0] * 3, abs=STEP)
    assert leaves == pytest.approx(0.2 * np.array([1.35, 1.15, 0.35]), abs=STEP)  # as light.glsl says


@pytest.mark.parametrize(
    ("scale", "axis"),
    sweep(
        product([[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [-2.0, -0.5, 1.0]], [0, 1]),
        test=[([-1.0, 1.0, 1.0], 0), ([-2.0, -0.5, 1.0], 1)],
    ),
)
def test_a_mirrored_instance_shows_its_front_with_its_bumps_mirrored(
    render: Render, axis: int, scale: list[float]
) -> None:
    """The map tilts all normals by 0.6 along one axis, the sun stands there too."""
    tilt = [76, 0] if axis == 0 else [0, 76]
    x = 76 / 127
    sun = [0.0, 0.0, (1 - x * x) ** 0.5]
    sun[axis] = x
    one = thing("a", {"m": material(**WHITE, normal="bumps")}, instance([0.0] * 3) | {"scale": scale})
    bumps = {"bumps": texel(*tilt, fmt="RG8_SNORM", kind=np.int8)}
    seen = middle(render([one], {"a": quad()}, bumps, sun=(sun, 0.9 * pi)))
    side = 1.0 if scale[axis] > 0 else -1.0
    assert seen == pytest.approx([0.9 * (sun[2] ** 2 + side * x * x)] * 3, abs=STEP)


@pytest.mark.parametrize(
    "scale",
    sample(
        [[3.0, -1.0, 2.0], [1.0, 2.0, 1.0], [1.0, 0.5, 1.0], [1e-6, 2e-6, 1e-6], [1e6, 5e5, 1e6]], every=3
    ),
)
def test_uneven_scale_keeps_normals_upright_on_their_surface(render: Render, scale: list[float]) -> None:
    one = thing("a", {"m": material(**WHITE)}, instance([0.0, 0.0, 0.0]) | {"scale": scale})
    one["radius_m"] = 8.0 / scale[0]  # what is too small to be seen is not drawn
    normal = np.array([0.0, 1.0, 1.0]) / scale
    mesh = quad((0.0, 1.0, 1.0), size=2.0 / scale[0])
    seen = middle(render([one], {"a": mesh}, sun=([0.0, 0.0, 1.0], 0.9 * pi)))
    assert seen == pytest.approx([0.9 * normal[2] / np.linalg.norm(normal)] * 3, abs=STEP)


def directional_albedo(n_v: F64, roughness: float) -> F64:
    """(n, 2): what a rough surface reflects of light from all sides in one bounce, as factors of f0 and of 1.
    The integral over half vectors h of GGX with height-correlated Smith and Schlick's Fresnel: B. Karis,
    "Real Shading in Unreal Engine 4", 2013."""
    many, squared = 96, roughness**4
    u, azimuth = np.meshgrid((np.arange(many) + 0.5) / many, pi * (np.arange(many) + 0.5) / many)
    n_h = np.sqrt((1 - u) / (1 + (squared - 1) * u))
    found = []
    for c in np.atleast_1d(n_v):
        v_h = np.sqrt(1 - c * c) * np.sqrt(1 - n_h * n_h) * np.cos(azimuth) + c * n_h
        n_l = np.maximum(2 * v_h * n_h - c, 0.0)
        smith = n_l * np.sqrt(c * c * (1 - squared) + squared) + c * np.sqrt(
            n_l * n_l * (1 - squared) + squared
        )
        once = np.where((n_l > 0) & (v_h > 0), 2 * n_l * v_h / np.maximum(smith * n_h, 1e-12), 0.0)
        grazing = np.clip(1 - v_h, 0, 1) ** 5
        found.append([(once * (1 - grazing)).mean(), (once * grazing).mean()])
    return np.array(found)


def reflectance(f0: F64, n_v: F64, roughness: float, f90: float = 1.0) -> F64:
    """All bounces of light from all sides: C. Fdez-Aguera, "A Multiple-Scattering Microfacet Model for
    Real-Time Image-based Lighting", 2019. roughness: the square root of GGX's alpha."""
    at = np.linspace(0.0, 1.0, 65)
    table = directional_albedo(at, roughness)
    scale, bias = (np.interp(n_v, at, table[:, k])[..., None] for k in (0, 1))
    return np.asarray((f0 * scale + f90 * bias) / (1 - (f0 + (1 - f0) / 21) * (1 - scale - bias)))


def further_bounces(f0: float, n_v: float, roughness: float) -> float:
    """Of the sun's light: E. Turquin, "Practical multiple scattering compensation for microfacet models"."""
    return float(1 + f0 * (1 / directional_albedo(np.array([n_v]), roughness).sum() - 1))


def test_a_metal_sphere_reflects_the_light_from_all_around_in_its_own_colour(render: Render) -> None:
    color = [0.9, 0.5, 0.1]
    one = thing("a", {"m": material(color=color, metalness=1.0, smoothness=0.4)})
    seen = render([one], {"a": sphere(1.5)}, ambient=1.0)
    height = tan(FOV_RAD / 2)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    ray = np.stack(
        [(2 * x / WIDTH - 1) * height * WIDTH / HEIGHT, (1 - 2 * y / HEIGHT) * height, -np.ones_like(x)],
        axis=2,
    )
    ray /= np.linalg.norm(ray, axis=2)[..., None]
    along = -AWAY_M * ray[..., 2]
    inside = along**2 - AWAY_M**2 + 1.4**2 > 0
    depth = along - np.sqrt(np.maximum(along**2 - AWAY_M**2 + 1.5**2, 0.0))
    normal = (ray * depth[..., None] + [0, 0, AWAY_M]) / 1.5
    n_v = -(normal * ray).sum(axis=2)
    mirrored_y = ray[..., 1] + 2 * n_v * normal[..., 1]
    expected = (0.75 + 0.25 * mirrored_y)[..., None] * reflectance(np.array(color), n_v, 0.6)
    assert inside.sum() > 300
    assert np.abs(seen - expected)[inside].max() <= 2.5 / 255.0


@pytest.mark.parametrize(
    ("smoothness", "specular"), sweep(product([0.0, 0.3, 0.5, 0.9], [0.5, 1.0, 12.5]), test=[(0.5, 1.0)])
)
def test_a_white_surface_is_as_bright_as_light_from_all_sides(
    render: Render, smoothness: float, specular: float
) -> None:
    """Light that a varnish reflects does not reach the white below it: together they reflect all light,
    whatever the roughness and the reflectance, and no more than all (a white furnace)."""
    varnished = material(color=[1.0] * 3, specular=specular, smoothness=smoothness)
    tilts = (0.0, 0.8, 1.2)
    squares = [quad((sin(tilt), 0.0, cos(tilt)), size=1.2) for tilt in tilts]
    shiny, matte = (
        beside(render, [(one, square) for square in squares], ambient=1.0)
        for one in (varnished, material(**WHITE))
    )
    for seen, straight, tilt in zip(shiny, matte, tilts, strict=True):
        assert straight.min() > 0.5
        assert seen == pytest.approx(straight, abs=0.02), tilt


@pytest.mark.parametrize(
    ("metalness", "specular"), sample(product([0.0, 0.3, 1.0], [0.0, 0.125, 0.5]), every=5)
)
def test_at_grazing_angles_metal_and_the_rest_reflect_each_its_share(
    render: Render, metalness: float, specular: float
) -> None:
    """Metal reflects all light there. The rest does from f0 = 0.02 on; below it less, at 0 nothing."""
    grey, n_v = 0.2, 0.2
    one = thing(
        "a", {"m": material(color=[grey] * 3, metalness=metalness, specular=specular, smoothness=0.0)}
    )
    normal = np.array([(1 - n_v * n_v) ** 0.5, 0.0, n_v])
    plain = 0.08 * specular
    shown = min(50 * plain, 1.0)
    f0, f90 = metalness * grey + (1 - metalness) * plain, metalness + (1 - metalness) * shown
    color = (1 - metalness) * grey

    below = 1 - reflectance(np.full(3, plain), np.array(n_v), 1.0, shown)
    seen = middle(render([one], {"a": quad((*normal,), size=6.0)}, ambient=1.0))
    expected = 0.75 * (color * below + reflectance(np.full(3, f0), np.array(n_v), 1.0, f90))
    assert seen == pytest.approx(expected, abs=0.02)

    sun = 2 * n_v * normal - [0.0, 0.0, 1.0]  # the eye sees it mirrored
    seen = middle(render([one], {"a": quad((*normal,), size=6.0)}, sun=([*sun], 4 * pi)))
    grazing = (1 - n_v) ** 5
    of_plain = shown * shown * (3 - 2 * shown) * (plain + (1 - plain) * grazing)
    once = (1 - metalness) * of_plain + metalness * (grey + (1 - grey) * grazing)
    expected = np.full(3, 4 * n_v * color * (1 - of_plain) + once * further_bounces(f0, n_v, 1.0))
    assert seen == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize(
    ("smoothness", "n_v"), sweep(product([0.0, 0.5, 0.8], [0.3, 0.6, 1.0]), test=[(0.5, 0.6)])
)
def test_rough_metals_reflect_as_the_integral_says(render: Render, smoothness: float, n_v: float) -> None:
    one = thing("a", {"m": material(color=[0.8, 0.4, 0.2], metalness=1.0, smoothness=smoothness)})
    normal = ((1 - n_v * n_v) ** 0.5, 0.0, n_v)
    seen = middle(render([one], {"a": quad(normal)}, ambient=1.0))
    expected = reflectance(np.array([0.8, 0.4, 0.2]), np.array(n_v), 1.0 - smoothness)
    assert seen == pytest.approx(0.75 * expected, abs=0.02)


def test_the_light_that_a_varnish_reflects_of_the_sun_does_not_reach_the_colour_below(render: Render) -> None:
    """glTF's mix by Fresnel: at f0 = 0.5, straight on, half of the light enters."""
    sun = {"sun": ([0.0, 0.0, 1.0], 0.5 * pi)}
    one = thing("a", {"m": material(color=[1.0] * 3, specular=6.25, smoothness=0.0)})
    lobe = 0.5 * 0.5 * pi / (4 * pi) * further_bounces(0.5, 1.0, 1.0)
    assert middle(render([one], {"a": quad()}, **sun)) == pytest.approx([0.5 * 0.5 + lobe] * 3, abs=2 * STEP)


@pytest.mark.parametrize(
    ("size", "fmt", "texels", "factor"),
    sample(
        [
            (size, *one)
            for one in (("R8_UNORM", (128,), 1.0), ("RG8_UNORM", (128, 64), 64 / 255))
            for size in (1, 4)
        ],
        every=3,
    ),
)
def test_occlusion_darkens_the_light_from_all_around_and_its_green_is_metalness(
    render: Render, fmt: str, texels: tuple[int, ...], factor: float, size: int
) -> None:
    one = material(**WHITE, metalness=0.5, occlusion="map", occlusion_strength=0.5, smoothness=0.0)
    maps = {"map": texture(fmt, np.full((size, size, len(texels)), texels, np.uint8))}
    sunny = middle(render([thing("a", {"m": one})], {"a": quad()}, maps, sun=([0.0, 0.0, 1.0], 0.5 * pi)))
    metalness = 0.5 * factor
    lobe = metalness * 0.5 * pi / (4 * pi)  # GGX with alpha 1, straight on
    lobe *= further_bounces(metalness, 1.0, 1.0)
    assert sunny == pytest.approx([0.5 * (1 - metalness) + lobe] * 3, abs=STEP)
    shade = middle(render([thing("a", {"m": one})], {"a": quad()}, maps, ambient=1.0))
    open_share = 1 - 0.5 * (1 - 128 / 255)
    # S. Lagarde, C. de Rousiers, 2014: roughness 1, straight on
    shine = (1 + open_share) ** (2.0**-17) - 1 + open_share
    reflected = reflectance(np.full(3, metalness), np.ones(()), 1.0)
    expected = 0.75 * (open_share * (1 - metalness) + shine * reflected)
    assert shade == pytest.approx(expected, abs=2 * STEP)


def test_thousands_of_instances_are_one_draw_call_and_stand_where_they_should(render: Render) -> None:
    """A point lights every third pixel."""
    metres = 2 * AWAY_M * tan(FOV_RAD / 2) / HEIGHT
    columns, rows = np.arange(1, WIDTH, 3), np.arange(1, HEIGHT, 3)
    stands = [
        instance([(x + 0.5 - WIDTH / 2) * metres, (HEIGHT / 2 - y - 0.5) * metres, 0.0], scale=metres)
        for y in rows
        for x in columns
    ]
    hidden = [instance([0.0, 0.0, -1.0 - 0.01 * k], scale=1e-3) for k in range(5000)]
    result: dict[str, Any] = {}
    one = thing("a", {"m": glow(0.5, 1.0, 0.0)}, *stands, *hidden)
    seen = render([one], {"a": quad(size=1.0)}, report=result)
    expected = np.zeros((HEIGHT, WIDTH, 3))
    expected[1::3, 1::3] = [0.5, 1.0, 0.0]
    assert np.abs(seen - expected).max() <= 2 * STEP
    assert result["draw_calls"] == 1


def test_materials_that_share_a_texture_load_it_once(render: Render) -> None:
    bytes_of = []
    for count in (1, 3):
        result: dict[str, Any] = {}
        things = [thing(f"t{k}", {"m": material("map")}, mesh="a_mesh") for k in range(count)]
        render(things, {"a": quad()}, {"map": texel(9, 9, 9, 255)}, report=result)
        bytes_of.append(result["total_bytes"])
    assert bytes_of[0] == bytes_of[1]


def test_a_blended_surface_casts_a_lighter_shadow(render: Render) -> None:
    """A wall above the eye's view shades the wall that the eye sees."""
    sun = ([0.0, 0.6, 0.8], 0.9 * pi)
    shadow = {"size": 512, "extent_m": 20.0, "center": [0.0, 0.0, 0.0], "blur_distance_m": 50.0}
    wall = thing("wall", {"m": material(**WHITE)}, views=["camera", "shadow"])
    light = []
    for opacity in (0.0, 0.5, 1.0):
        veil = glow(0.0, 0.0, 0.0, alpha_mode="blend", opacity=opacity)
        above = thing("veil", {"m": veil}, instance([0.0, 3.0, 4.0], scale=3.0), views=["shadow"])
        seen = render([wall, above], {"wall": quad(size=9.0), "veil": quad()}, sun=sun, shadow=shadow)
        light.append(float(seen[HEIGHT // 2 - 8 : HEIGHT // 2 + 8, WIDTH // 2 - 8 : WIDTH // 2 + 8].mean()))
    assert light[0] == pytest.approx(0.9 * 0.8, abs=STEP)
    assert light[1] == pytest.approx(0.5 * light[0], abs=0.05)
    assert light[2] == pytest.approx(0.0, abs=STEP)


def test_a_mask_casts_a_shadow_only_where_it_has_the_cutoff(render: Render) -> None:
    sun = ([0.0, 0.6, 0.8], 0.9 * pi)
    shadow = {"size": 512, "extent_m": 20.0, "center": [0.0, 0.0, 0.0], "blur_distance_m": 50.0}
    wall = thing("wall", {"m": material(**WHITE)}, views=["camera", "shadow"])
    light = []
    for cutoff in (0.4, 0.6):
        veil = material("half", **BLACK, alpha_mode="mask", alpha_cutoff=cutoff)
        above = thing("veil", {"m": veil}, instance([0.0, 3.0, 4.0], scale=3.0), views=["shadow"])
        meshes, maps = {"wall": quad(size=9.0), "veil": quad()}, {"half": texel(255, 255, 255, 128)}
        light.append(middle(render([wall, above], meshes, maps, sun=sun, shadow=shadow)).mean())
    assert light == pytest.approx([0.0, 0.9 * 0.8], abs=STEP)


def test_alpha_of_vertex_colours_counts_in_shadows_where_the_material_says_so(render: Render) -> None:
    """Squares above the eye's view shade the wall. Their vertices have an alpha of 0.5."""
    sun = ([0.0, 0.6, 0.8], 0.9 * pi)
    shadow = {"size": 512, "extent_m": 20.0, "center": [0.0, 0.0, 0.0], "blur_distance_m": 50.0}
    wall = thing("wall", {"m": material(**WHITE)}, views=["camera", "shadow"])
    changes: list[dict[str, Any]] = [
        {"alpha_mode": "mask", "alpha_cutoff": 0.4},
        {"alpha_mode": "mask", "alpha_cutoff": 0.6},
        {"alpha_mode": "mask", "alpha_cutoff": 0.6, "vertex_colors": False},
        {"alpha_mode": "blend"},
    ]
    columns, casters = 24 * np.arange(len(changes)) + 12, []
    for k, (change, x) in enumerate(zip(changes, columns, strict=True)):
        one = material(**(BLACK | {"vertex_colors": True} | change))
        place = [(float(x) - WIDTH / 2) * 2.0 * AWAY_M * tan(0.5 * FOV_RAD) / HEIGHT, 3.0, 4.0]
        casters.append(thing(f"t{k}", {"m": one}, instance(place), mesh="veil_mesh", views=["shadow"]))
    seen = render([wall, *casters], {"wall": quad(size=9.0), "veil": quad()}, sun=sun, shadow=shadow)
    light = [seen[HEIGHT // 2 - 5 : HEIGHT // 2 + 5, x - 5 : x + 5].mean() for x in columns]
    assert light[:3] == pytest.approx([0.0, 0.9 * 0.8, 0.0], abs=STEP)
    assert light[3] == pytest.approx(0.5 * 0.9 * 0.8, abs=0.05)


@pytest.mark.parametrize("view", sweep(["camera", "reflection", "refraction"], test=["reflection"]))
def test_a_blended_object_shows_in_each_view(player: Callable[..., Any], tmp_path: Path, view: str) -> None:
    """The box of the small scene, half in the sea. Half as opaque, it changes the picture half as much."""
    pictures = []
    for opacity in (None, 0.5, 1.0):
        folder = write_scene(tmp_path / str(opacity))
        scene = json.loads((folder / "scene.json").read_text())
        (box,) = scene["objects"]
        scene["water"] |= {
            "level_m": 1.2,
            "reflection_distortion": 0.0,
            "refraction_distortion": 0.0,
            "absorption_per_m": [0.0] * 3,
        }
        shown = [] if opacity is None else [box | {"views": [view]}]
        scene |= {"shadow": None, "particles": [], "objects": shown}
        for one in box["materials"].values():
            one |= {"alpha_mode": "blend", "opacity": opacity or 0.0, "two_sided": False}
        (folder / "scene.json").write_text(json.dumps(scene))
        out = tmp_path / "a.png"
        result = player(
            folder, "--size", "160x90", "--screenshot", out, "--disable", "post", "--check-finite"
        )
        assert result.returncode == 0, result.stderr
        pictures.append(np.asarray(oiio.ImageBuf(str(out)).get_pixels(oiio.UINT8), np.float64))
    none, half, whole = pictures
    changed = np.abs(whole - none).max(axis=2) > 20
    assert changed.sum() > 100
    assert np.abs((half - none) - 0.5 * (whole - none))[changed].max() < 4.0 * 255 * STEP


@pytest.mark.parametrize("mode", ["mask", "blend"])
def test_a_layer_on_the_triangles_of_another_material_is_drawn_over_them(render: Render, mode: str) -> None:
    """As stickers on a wall: both have the same vertices, so the same depths."""
    wall = quad()
    layers = replace(
        wall,
        triangles=np.concatenate([wall.triangles, wall.triangles]),
        groups=(Group("m", "wall", 0, 2), Group("m", "sticker", 2, 2)),
        colors=None,
    )
    materials = {
        "wall": material() | BLACK,
        "sticker": material(alpha_mode=mode) | WHITE,
    }
    light = render([thing("a", materials)], {"a": layers}, ambient=1.0)
    assert light[HEIGHT // 2, WIDTH // 2] == pytest.approx([0.75] * 3, abs=STEP)
