"""A gallery: a scene of many models of others, each as its exporter wrote it, on a small island in the sea.

`write_models` makes such models: OBJ, STL and glTF; several materials; authored maps; holes,
glass, light, metal, vertex colours, a palette, Draco and meshopt. `make_gallery` sets models up, some
mirrored or stretched.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import DracoPy
import meshoptimizer
import numpy as np

from paradize.formats.png import encode_png
from paradize.readers.model import read_model
from tests.made.blender import write_glb, write_obj
from tests.made.models import unwrapped, write_kit
from tests.made.pictures import field, leaf, photograph
from tests.pipeline.material_scene import noise, squares
from tests.pipeline.readers.gltf.made import SQUARE, Made, shown, square
from tests.pipeline.scenes import write_image

SKY = (0.42, 0.5, 0.62)  # linear, on all sides
COLUMNS, STEPS_M = 7, (2.0, 2.4)  # along x and z
SCENE = """
[scene]
name = "gallery"
viewport = [448, 252]
[sun]
azimuth_deg = 215.0
elevation_deg = 42.0
color = [1.0, 0.93, 0.82]
intensity = 2.4
[ambient]
color = [{sky}]
intensity = 1.0
[sky]
faces = ["sky.exr", "sky.exr", "sky.exr", "sky.exr", "sky.exr", "sky.exr"]
[shadow]
size = 1024
extent_m = 18.0
[reflection]
scale = 0.25
[terrain]
heightmap = "ground.png"
size_m = [32.0, 32.0]
height_m = 4.0
base_m = -4.0
max_error_m = 0.02
sand_color = "sand.png"
sand_repeat = 8.0
[water]
waves = "waves.png"
level_m = -0.8
size_m = 200.0
[flight]
duration_s = 20.0
far_m = 200.0
eye = [{{ position = [-2, 6.4, 10] }}, {{ position = [2, 6.4, 10] }}, {{ position = [0, 6.8, 11] }}]
target = [{{ position = [0, 0, 0.3] }}, {{ position = [0.2, 0, 0.3] }}, {{ position = [-0.2, 0, 0.3] }}]
"""
UPRIGHT = (0.0, (1.0, 1.0, 1.0))  # yaw in degrees; factors along the model's axes
MIRRORED = (30.0, (-1.0, 1.0, 1.0))
UNEVEN = (-40.0, (0.6, 1.2, -0.9))


@dataclass(frozen=True)
class Exhibit:
    """A model of the gallery. file: below the scene's folder. toml: more lines of its [[object]]. stands: yaw
    and factors of each instance. size_m: its longest side, before the factors. table: the instances after the
    first stand in a CSV file."""

    name: str
    file: str
    toml: str = ""
    stands: tuple[tuple[float, tuple[float, float, float]], ...] = (UPRIGHT,)
    size_m: float = 1.5
    table: bool = False


ONE_LEVEL = "lods = 1\n"  # where a model of the same kind has all levels of detail
MADE = (  # the tall ones first: they stand behind
    Exhibit("house", "kit/house.obj", ONE_LEVEL, size_m=1.8),
    Exhibit("tower", "kit/tower.obj", ONE_LEVEL, size_m=2.2),
    Exhibit("tree", "kit/tree.obj", ONE_LEVEL, stands=(UPRIGHT, MIRRORED, UNEVEN), table=True, size_m=1.8),
    Exhibit("plain", "kit/plain.obj", ONE_LEVEL, size_m=1.8),
    Exhibit("urn", "kit/urn.obj", stands=(UNEVEN,)),
    Exhibit("chair", "chair/chair.glb", stands=(UPRIGHT, MIRRORED)),
    Exhibit("stool", "stool/stool.obj", ONE_LEVEL, stands=((140.0, (1.0, 1.0, 1.0)),)),
    Exhibit("window", "window.gltf", stands=((20.0, (1.0, 1.0, 1.0)), (-20.0, (-1.0, 1.0, 1.0)))),
    Exhibit("lantern", "lantern.gltf"),
    Exhibit("ball", "ball.glb"),
    Exhibit("gem", "gem.gltf", stands=(UNEVEN,)),
    Exhibit("panels", "panels/panels.obj", size_m=2.4),
    Exhibit("fern", "fern.glb", stands=(UPRIGHT, MIRRORED)),
    Exhibit(
        "vase",
        "vase/vase.obj",
        'lods = 2\n[object.material.default]\ncolor = "vase/color.png"\n'
        'normal = "vase/down.png"\ngreen = "down"\n'
        'smoothness_map = "vase/smooth.png"\nmetalness = "vase/metal.png"\nspecular = 0.5\n',
        stands=(UPRIGHT, UNEVEN),
    ),
    Exhibit("stone", "stone.stl", size_m=1.2),
)


def make_gallery(folder: Path, exhibits: tuple[Exhibit, ...] = MADE) -> Path:
    """Writes the scene and its ground around models that are there; returns the scene's file."""
    write_ground(folder)
    text = SCENE.format(sky=", ".join(map(str, SKY)))
    cells = itertools.count()
    total = sum(len(one.stands) for one in exhibits)
    for one in exhibits:
        positions = read_model(folder / one.file).mesh.positions.astype(np.float64)
        low, high = positions.min(axis=0), positions.max(axis=0)
        foot = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
        rows = []
        for yaw_deg, factors in one.stands:
            at = next(cells)
            scale = np.array(factors) * one.size_m / np.ptp(positions, axis=0).max()
            x, y, z = foot * scale
            sine, cosine = np.sin(np.radians(yaw_deg)), np.cos(np.radians(yaw_deg))
            place = np.array(
                [
                    (at % COLUMNS - (COLUMNS - 1) / 2) * STEPS_M[0] - (cosine * x + sine * z),
                    -y,
                    (at // COLUMNS - (total - 1) // COLUMNS / 2) * STEPS_M[1] - (cosine * z - sine * x),
                ]
            )
            rows.append([round(float(value), 6) for value in (*place, yaw_deg, *scale)])
        text += f'\n[[object]]\nname = "{one.name}"\nmesh = "{one.file}"\n'
        if one.table:
            text += f'instances = "{one.name}.csv"\n'
            lines = ["x,y,z,yaw_deg,scale_x,scale_y,scale_z", *(",".join(map(str, row)) for row in rows[1:])]
            (folder / f"{one.name}.csv").write_text("\n".join(lines) + "\n")
        text += one.toml
        for row in rows[:1] if one.table else rows:
            text += f"[[object.instance]]\nposition = {row[:3]}\nyaw_deg = {row[3]}\nscale = {row[4:]}\n"
    path = folder / "gallery.toml"
    path.write_text(text)
    return path


def write_ground(folder: Path) -> None:
    """A flat island that falls into the sea, its sand, waves, and a sky of one colour."""
    z, x = np.mgrid[-1:1:65j, -1:1:65j]
    flat = np.clip(4.0 - 4.0 * np.hypot(x, z), 0.0, 1.0)
    write_image(folder / "ground.png", (flat * 65535).astype(np.uint16)[:, :, None])
    sand = 200.0 + 40.0 * (field(64, 64, 3)[:, :, None] - 0.5) * [1.0, 0.95, 0.8] - [0.0, 15.0, 45.0]
    write_image(folder / "sand.png", sand.astype(np.uint8))
    waves = 0.5 + 0.25 * np.sin(2 * np.pi * np.arange(32) / 32)
    write_image(folder / "waves.png", (np.add.outer(waves, waves) * 32767).astype(np.uint16)[:, :, None])
    write_image(folder / "sky.exr", np.full((8, 8, 3), SKY, np.float32))


def write_models(folder: Path) -> None:
    """The models of MADE, in a new folder. The same bytes in every run."""
    for name in ("panels", "chair", "stool", "vase"):
        (folder / name).mkdir(parents=True)
    write_panels(folder / "panels")
    write_glb(folder / "chair/chair.glb")
    write_obj(folder / "stool/stool.obj")
    write_kit(folder / "kit")
    write_vase(folder / "vase")
    packed_ball().glb(folder / "ball.glb")
    packed_gem().gltf(folder / "gem.gltf")
    glass().gltf(folder / "window.gltf")
    lantern().gltf(folder / "lantern.gltf", "lantern.bin")
    (folder / "lantern.bin").write_bytes(lantern().data)
    fern().glb(folder / "fern.glb")
    stone = shapes().icosphere(subdivisions=2)
    stone.vertices *= 1.0 + 0.15 * np.sin(5.0 * stone.vertices[:, [1, 2, 0]])
    (folder / "stone.stl").write_bytes(stone.export(file_type="stl"))


def write_panels(folder: Path) -> None:
    """Three materials of one OBJ: wood with normals, metal with a gloss, a leaf with holes."""
    write_image(folder / "wood.png", noise(1))
    tilt = (noise(2, 2).astype(np.float64) - 127.0) / 250.0
    up = np.sqrt(1.0 - (tilt**2).sum(axis=2, keepdims=True))
    write_image(
        folder / "wood_n.png",
        np.round(127.5 * np.concatenate([tilt, up], axis=2) + 127.5).astype(np.uint8),
    )
    write_image(folder / "metal.png", noise(3))
    write_image(folder / "rough.png", noise(4, 1))
    write_image(folder / "leaf.png", leaf(64))
    (folder / "panels.mtl").write_text(
        "newmtl wood\nmap_Kd wood.png\nnorm wood_n.png\nKs 0.4 0.4 0.4\nNs 60\n"
        "newmtl metal\nmap_Kd metal.png\nPm 1\nmap_Pr rough.png\n"
        "newmtl leaf\nmap_Kd leaf.png\n"
    )
    (folder / "panels.obj").write_text(squares(["wood", "metal", "leaf"], "panels.mtl"))


def write_vase(folder: Path) -> None:
    """Its maps are named by the scene: normals with green down, smoothness, metalness."""
    (folder / "vase.obj").write_text(unwrapped(16, 24))
    write_image(folder / "color.png", photograph(64, 64, 8))
    slopes = 0.4 * np.sin(np.arange(64) * np.pi / 8)
    x, y = np.meshgrid(slopes, slopes)
    normals = np.stack([x, y, np.ones_like(x)], axis=-1) / np.sqrt(1 + x * x + y * y)[..., None]
    write_image(folder / "down.png", np.rint(127.5 + 127.5 * normals).astype(np.uint8))
    write_image(folder / "smooth.png", noise(9, 1))
    write_image(
        folder / "metal.png", ((np.indices((64, 64)) // 16).sum(axis=0) % 2 * 255)[..., None].astype("u1")
    )


def shapes() -> ModuleType:
    """The makers of shapes of trimesh, which loads scipy: only where a gallery is made."""
    from trimesh import creation

    return creation


def packed_ball() -> Made:
    """Draco: brushed metal of one colour, without UVs."""
    made, ball = Made(), shapes().icosphere(subdivisions=3)
    data = DracoPy.encode(
        ball.vertices.astype(np.float32), ball.faces.astype(np.uint32), quantization_bits=14
    )
    extension = {"bufferView": made.view(data), "attributes": {"POSITION": 0}}
    position = made.add("accessors", componentType=5126, count=len(ball.vertices), type="VEC3")
    primitive = {
        "attributes": {"POSITION": position},
        "indices": made.add("accessors", componentType=5125, count=ball.faces.size, type="SCALAR"),
        "extensions": {"KHR_draco_mesh_compression": extension},
        "material": made.add(
            "materials",
            name="brass",
            pbrMetallicRoughness={
                "baseColorFactor": [0.9, 0.6, 0.25, 1.0],
                "metallicFactor": 1.0,
                "roughnessFactor": 0.35,
            },
        ),
    }
    made.tree["extensionsUsed"] = made.tree["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    return shown(primitive, made)


def packed_gem() -> Made:
    """meshopt: a dull ball with vertex colours."""
    made, gem = Made(), shapes().icosphere(subdivisions=2)
    used = {"extensionsUsed": ["EXT_meshopt_compression"], "extensionsRequired": ["EXT_meshopt_compression"]}
    made.tree |= used
    positions = gem.vertices.astype(np.float32)
    colors = np.concatenate([0.5 + 0.5 * positions, np.ones((len(positions), 1))], axis=1).astype(np.float32)

    def packed(data: bytes, count: int, stride: int, mode: str) -> int:
        view = made.view(data)
        inner = made.tree["bufferViews"].pop(view) | {"count": count, "byteStride": stride, "mode": mode}
        return made.add(
            "bufferViews",
            buffer=0,
            byteLength=count * stride,
            extensions={"EXT_meshopt_compression": inner},
        )

    def vertices(values: np.ndarray, kind: str) -> int:
        data = meshoptimizer.encode_vertex_buffer(values, len(values), values.strides[0])
        view = packed(data, len(values), values.strides[0], "ATTRIBUTES")
        return made.add("accessors", bufferView=view, componentType=5126, count=len(values), type=kind)

    corners = gem.faces.astype(np.uint32).reshape(-1)
    data = meshoptimizer.encode_index_buffer(corners, corners.size, len(positions))
    view = packed(data, corners.size, 4, "TRIANGLES")
    primitive = {
        "attributes": {"POSITION": vertices(positions, "VEC3"), "COLOR_0": vertices(colors, "VEC4")},
        "indices": made.add(
            "accessors", bufferView=view, componentType=5125, count=corners.size, type="SCALAR"
        ),
        "material": made.add(
            "materials", name="clay", pbrMetallicRoughness={"metallicFactor": 0.0, "roughnessFactor": 0.9}
        ),
    }
    return shown(primitive, made)


def texture(made: Made, pixels: np.ndarray) -> dict[str, int]:
    """A picture inside the document."""
    image = made.add("images", bufferView=made.view(encode_png(pixels)), mimeType="image/png")
    return {"index": made.add("textures", source=image)}


UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
AHEAD = np.tile(np.float32([0, 0, 1]), (4, 1))


def glass() -> Made:
    """Panes of blended colour in a picture whose alpha differs, seen from both sides."""
    made, primitive = square(TEXCOORD_0=UVS, NORMAL=AHEAD)
    panes = np.dstack([noise(6), np.kron([[90, 200], [220, 60]], np.ones((32, 32)))]).astype(np.uint8)
    primitive["material"] = made.add(
        "materials",
        name="glass",
        alphaMode="BLEND",
        doubleSided=True,
        pbrMetallicRoughness={
            "baseColorTexture": texture(made, panes),
            "baseColorFactor": [0.9, 1.0, 1.0, 0.8],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.2,
        },
    )
    return shown(primitive, made)


def lantern() -> Made:
    """A box that glows brighter than white, with half of its occlusion, and vertex colours in bytes."""
    made, box = Made(), shapes().box(extents=(1, 1.4, 1))
    corners = box.vertices[box.faces].reshape(-1, 3).astype(np.float32)
    normals = np.repeat(box.face_normals, 3, axis=0).astype(np.float32)
    across = np.where(np.abs(normals[:, :1]) > 0.5, corners[:, [2, 1]], corners[:, [0, 1]])
    across = np.where(np.abs(normals[:, 1:2]) > 0.5, corners[:, [0, 2]], across)
    uvs = (0.5 + across / [1.0, 1.4]).astype(np.float32)
    shade = np.rint(155 + 100 * (corners[:, 1:2] > 0)).repeat(4, axis=1).astype(np.uint8)
    shade[:, 3] = 255
    glow = np.zeros((32, 32, 3), np.uint8)
    glow[8:24, 8:24] = noise(7, size=16)
    primitive = {
        "attributes": {
            "POSITION": made.array(corners),
            "NORMAL": made.array(normals),
            "TEXCOORD_0": made.array(uvs),
            "COLOR_0": made.array(shade, normalized=True),
        },
        "material": made.add(
            "materials",
            name="lamp",
            emissiveFactor=[1.0, 0.8, 0.5],
            emissiveTexture=texture(made, glow),
            occlusionTexture=texture(made, noise(8)) | {"strength": 0.5},
            pbrMetallicRoughness={"baseColorFactor": [0.5, 0.4, 0.35, 1.0], "metallicFactor": 0.0},
            extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 2.5}},
        ),
    }
    made.tree["extensionsUsed"] = ["KHR_materials_emissive_strength"]
    return shown(primitive, made)


def fern() -> Made:
    """Two crossed leaves with holes; each shows a part of the picture that KHR_texture_transform names."""
    made = Made()
    picture = np.zeros((64, 128, 4), np.uint8)
    picture[:, :64], picture[:, 64:] = leaf(64), leaf(64)[:, :, [1, 0, 2, 3]]
    shared = texture(made, picture)
    primitives = []
    for k, across in enumerate(([0, 2], [2, 0])):
        corners = SQUARE.copy()
        corners[:, across] = SQUARE[:, [0, 2]] - [0.5, 0]
        normals = np.zeros_like(corners)
        normals[:, across[1]] = 1.0 if k == 0 else -1.0
        moved = {"KHR_texture_transform": {"offset": [0.5 * k, 0.0], "scale": [0.5, 1.0]}}
        primitives.append(
            {
                "attributes": {
                    "POSITION": made.array(corners),
                    "NORMAL": made.array(normals),
                    "TEXCOORD_0": made.array(UVS),
                },
                "indices": made.array(np.array([0, 1, 2, 0, 2, 3], np.uint16)),
                "material": made.add(
                    "materials",
                    name=f"leaf {k}",
                    alphaMode="MASK",
                    alphaCutoff=0.4,
                    doubleSided=True,
                    pbrMetallicRoughness={
                        "baseColorTexture": shared | {"extensions": moved},
                        "metallicFactor": 0.0,
                        "roughnessFactor": 0.8,
                    },
                ),
            }
        )
    made.tree["extensionsUsed"] = ["KHR_texture_transform"]
    made.show(made.add("nodes", mesh=made.mesh(*primitives)))
    return made
