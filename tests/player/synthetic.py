"""A small scene folder made without a bake: a box on a sand plane, with or without sea, sky and shadow."""

from __future__ import annotations

import hashlib
from functools import cache
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Group, Lod, Mesh, Texture
from paradize.formats.glb.encode import encode_glb
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.scene.manifest import VERSION, encode_scene
from paradize.formats.scene.schema import MATERIAL_MAPS
from tests.player.patches import Tiled, tiled

SUN = [0.6, 0.64, 0.48]
EYE = [0.0, 3.0, 9.0]


def _levels(texels: npt.NDArray[Any]) -> tuple[bytes, ...]:
    """Mips of every second texel, which is enough for these tests."""
    levels = [np.ascontiguousarray(texels)]
    while max(levels[-1].shape[-3:-1]) > 1:
        levels.append(np.ascontiguousarray(levels[-1][..., ::2, ::2, :]))
    return tuple(level.tobytes() for level in levels)


def texture(fmt: str, texels: npt.NDArray[Any]) -> bytes:
    """KTX2 of (size, size, c) texels, or (6, size, size, c) for a cube map; size is a power of two."""
    size, faces = texels.shape[-2], 6 if texels.ndim == 4 else 1
    return encode_ktx2(Texture(fmt, size, size, _levels(texels), faces))


def _f32(values: Any) -> npt.NDArray[np.float32]:
    return np.ascontiguousarray(values, dtype=np.float32)


def box() -> Mesh:
    """Two metres wide, standing on y = 0; four of its faces are wood, two are leaf."""
    positions, normals, tangents, uvs, triangles = [], [], [], [], []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal, tangent = np.zeros(3), np.zeros(3)
            normal[axis], tangent[(axis + 1) % 3] = sign, sign
            up, first = np.cross(normal, tangent), len(positions)
            for x, y in ((-1, 1), (1, 1), (-1, -1), (1, -1)):
                positions.append(normal + x * tangent + y * up + [0, 1, 0])
                normals.append(normal)
                tangents.append([*tangent, 1.0])
                uvs.append([(x + 1) / 2, (1 - y) / 2])
            triangles += [[first, first + 2, first + 1], [first + 1, first + 2, first + 3]]
    groups = (Group("trunk", "wood", 0, 8), Group("leaves", "leaf", 8, 4))
    faces = np.asarray(triangles, dtype=np.uint32)
    return Mesh(_f32(positions), faces, _f32(normals), _f32(tangents), _f32(uvs), groups=groups)


def checker(a: tuple[int, int, int], b: tuple[int, int, int], size: int = 64) -> npt.NDArray[np.uint8]:
    """(size, size, 4) uint8: eight by eight squares of two colours."""
    y, x = np.mgrid[0:size, 0:size] * 8 // size
    squares = np.where(((x + y) % 2 == 0)[..., None], np.uint8(a), np.uint8(b))
    return np.dstack([squares, np.full((size, size), 255, dtype=np.uint8)])


@cache
def flat_terrain() -> Tiled:
    """60 m of flat terrain in patches; scene.json states errors for the coarse levels."""
    return tiled(60.0, error_m=0.2)


def write_scene(folder: Path, *, bare: bool = False, terrain: Tiled | None = None, **changes: Any) -> Path:
    """Writes scene.json and its artifacts. `bare` leaves out every optional pass. `changes` replace top-level
    members of scene.json."""
    ground = None if bare else terrain or flat_terrain()
    folder.mkdir(parents=True, exist_ok=True)
    files = _box_files()
    if ground:
        files = files | _pass_files()
        files |= {
            name: ("glb", "mesh", data) for name, data in zip(tile_names(ground), ground.tiles, strict=True)
        }
    artifacts = {}
    for name, (ending, kind, data) in files.items():
        (folder / f"{name}.{ending}").write_bytes(data)
        artifacts[name] = {
            "file": f"{name}.{ending}",
            "kind": kind,
            **identity(data),
            "tier": "balanced",
            "errors": {},
            "levels": [],
            "max_level": None,
            "required_detail": None,
            "gutter": None,
            "also": [],
            "first_needed_s": 0.0,
        }
    manifest = _manifest(artifacts, ground) | changes
    (folder / "scene.json").write_bytes(encode_scene(manifest))
    return folder


Files = dict[str, tuple[str, str, bytes]]  # by name: ending, kind, bytes


def _box_files() -> Files:
    return {
        "box_mesh": ("glb", "mesh", encode_glb([Lod(box(), 0.0, 0.0), Lod(box(), 0.02, 0.01)], "box")),
        "box_color": ("ktx2", "texture", texture("RGBA8_SRGB", checker((200, 60, 40), (240, 220, 200)))),
    }


@cache
def _pass_files() -> Files:
    sand = texture("RGBA8_SRGB", checker((230, 210, 160), (210, 190, 140)))
    diagonal = np.indices((16, 16)).sum(axis=0).astype(np.int8)[..., None] - np.int8(15)
    waves = texture("RG8_SNORM", np.repeat(diagonal, 2, axis=2))
    sky = np.full((6, 8, 8, 4), [0.3, 0.5, 0.9, 1.0], dtype=np.float16)
    return {
        "sand_color": ("ktx2", "texture", sand),
        "effect_normal": ("ktx2", "texture", texture("RG8_SNORM", np.zeros((16, 16, 2), dtype=np.int8))),
        "water_normal": ("ktx2", "texture", waves),
        "water_dudv": ("ktx2", "texture", waves),
        "sky": ("ktx2", "cubemap", texture("RGBA16F", sky)),
    }


def identity(data: bytes) -> dict[str, Any]:
    """SHA-256 and size of an artifact, as scene.json states them and the player checks them."""
    return {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}


def tile_names(terrain: Tiled) -> list[str]:
    """Names of the terrain tiles' artifacts."""
    return ["terrain_mesh", *(f"terrain_mesh_{i}" for i in range(1, len(terrain.tiles)))]


def material(picture: str | None = None, /, **changes: Any) -> dict[str, Any]:
    """A material of scene.json with a colour map. `changes` replace its members, or its maps by their
    names."""
    maps = {key: changes.pop(key, None) for key in MATERIAL_MAPS if key not in ("color", "emission")}
    return {
        "color": [1.0, 1.0, 1.0],
        "opacity": 1.0,
        "maps": {"color": picture, **maps, "emission": changes.pop("emission_map", None)},
        "wrap": ["repeat", "repeat"],
        "nearest": False,
        "metalness": 0.0,
        "emission": [0.0, 0.0, 0.0],
        "specular": 0.2,
        "smoothness": 0.5,
        "occlusion_strength": 1.0,
        "parallax_scale": 0.0,
        "parallax_bias": 0.0,
        "parallax_limit": None,
        "two_sided": False,
        "translucency": 0.0,
        "alpha_mode": "opaque",
        "alpha_cutoff": 0.5,
        "vertex_colors": False,
        "unlit": False,
        "vertex_lit": False,
    } | changes


def instance(position: list[float], yaw_rad: float = 0.0, scale: float = 1.0) -> dict[str, Any]:
    """An instance of scene.json that is turned about +Y."""
    half = 0.5 * yaw_rad
    return {"position": position, "rotation": [0.0, sin(half), 0.0, cos(half)], "scale": [scale] * 3}


def sound(artifact: str, **changes: Any) -> dict[str, Any]:
    """A sound of scene.json that is heard everywhere."""
    everywhere = {"places": [], "radius_m": 1.0, "falloff": 1.0, "hours": None}
    return {"name": None, "artifact": artifact, "volume": 1.0} | everywhere | changes


def _manifest(artifacts: dict[str, Any], ground: Tiled | None) -> dict[str, Any]:
    wood = material("box_color")
    still = [[0.0, 0.0, 0.0, 0.0]] * 3
    # Back and forth on a line past the box, ten seconds per round trip.
    way = [[[-2.0, 4.0, 0.0, 0.0], [EYE[1], 0, 0, 0], [EYE[2], 0, 0, 0]]]
    way.append([[2.0, -4.0, 0.0, 0.0], [EYE[1], 0, 0, 0], [EYE[2], 0, 0, 0]])
    manifest: dict[str, Any] = {
        "format": "paradize-scene",
        "version": VERSION,
        "name": "synthetic",
        "exposure": 1.0,
        "viewport": [96, 54],
        "largest_viewport": [96, 54],
        "free_camera": None,
        "lod_error_px": 1.0,
        "poster_s": 1.0,
        "artifacts": artifacts,
        "streaming": sorted(artifacts),
        "budget": {"hard": {}, "soft": {}},
        "check": {"severity": {}, "waivers": [], "tried": {}},
        "sun": {
            "direction": SUN,
            "color": [1.0, 0.9, 0.75],
            "intensity": 3.0,
            "angular_diameter_rad": 0.0093,
        },
        "ambient": {"color": [0.5, 0.65, 1.0], "intensity": 0.6},
        "fog": {"color": [0.7, 0.8, 0.9], "density_per_m": 0.001},
        "wind": None,
        "daytime": None,
        "sky": None,
        "shadow": None,
        "reflection": None,
        "refraction": None,
        "terrain": None,
        "water": None,
        "objects": [
            {
                "name": "box",
                "views": ["camera", "shadow", "reflection", "refraction"],
                "mesh": "box_mesh",
                "center": [0.0, 1.0, 0.0],
                "radius_m": 1.7321,
                "lods": [{"node": "lod0", "error_m": 0.0}, {"node": "lod1", "error_m": 0.05}],
                "materials": {"wood": wood, "leaf": wood | {"two_sided": True}},
                "sway": None,
                "motion": None,
                "instances": [instance([0.0, 0.0, 0.0], 0.4)],
            }
        ],
        "particles": [],
        "sounds": [],
        "music": None,
        "flight": {
            "duration_s": 10.0,
            "fov_rad": 0.9,
            "near_m": 0.2,
            "far_m": 500.0,
            "segments": [{"eye": eye, "target": still, "roll": [0.0, 0.0, 0.0, 0.0]} for eye in way],
            "time_table": [[0.0, 0.0, 0.2], [5.0, 1.0, 0.2], [10.0, 2.0, 0.2]],
            "waypoint_u": [0, 1],
            "errors": {},
        },
    }
    if ground:
        manifest |= {
            "sky": {"cubemap": "sky"},
            "shadow": {"size": 256, "extent_m": 30.0, "center": [0.0, 0.0, 0.0], "blur_distance_m": 20.0},
            "reflection": {"scale": 0.5},
            "refraction": {"scale": 0.5},
            "terrain": {
                "tiles": tile_names(ground),
                **ground.tables,
                "sand_color": "sand_color",
                "sand_normal": None,
                "effect_color": None,
                "effect_normal": "effect_normal",
                "sand_repeat": 8.0,
                "mix_low_m": -1.0,
                "mix_high_m": -0.5,
                "specular": 0.05,
                "smoothness": 0.2,
                "wet_high_m": 0.3,
                "wet_darkness": 0.4,
                "wet_smoothness": 0.6,
                "size_m": [60.0, 60.0],
                "height_range_m": [0.0, 0.0],
            },
            "water": {
                "normal": "water_normal",
                "dudv": "water_dudv",
                "level_m": -0.4,
                "size_m": 400.0,
                "wave_repeat": 40.0,
                "scroll_per_s": [0.03, 0.02],
                "reflection_distortion": 0.02,
                "refraction_distortion": 0.02,
                "deep_color": [0.003, 0.045, 0.1],
                "shallow_color": [0.05, 0.53, 0.52],
                "absorption_per_m": [0.4, 0.08, 0.06],
                "specular": 1.0,
                "smoothness": 0.95,
                "swash_height_m": 0.0,
                "swash_waves": 30,
                "wave_height_m": 0.0,
                "wave_length_m": 9.0,
            },
            "particles": [
                {
                    "name": "sparkle",
                    "center": [0.0, 2.0, 0.0],
                    "radius_m": 2.0,
                    "count": 40,
                    "size_m": [0.05, 0.15],
                    "life_per_s": [0.2, 0.6],
                    "threshold": 0.05,
                    "color": [1.0, 0.95, 0.8],
                }
            ],
        }
    return manifest
