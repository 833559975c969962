"""`paradize export`: writes a baked folder as one GLB that Blender, three.js and others open.

glTF cannot blend sand and effect map by height and has no water and no sky. So the terrain's colour becomes
one picture, the sea a translucent plane, the sky an unlit cube. Meshes are the finest levels and patches that
were baked; maps are PNG; the flight is an animation of the camera."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.data import ORIGIN, Mesh, Texture, Vec3
from paradize.documents import SCENE_FILE
from paradize.errors import BakeError, unread
from paradize.export.flight import flight_keys, quaternion
from paradize.export.ground_shade import contrasted, tone_of, toned, wetted
from paradize.export.heights import (
    GROUND_TEXELS,
    at_least,
    smoothstep,
    terrain_heights,
    under_water,
)
from paradize.export.pictures import (
    color_png,
    gloss_png,
    ground_light,
    normal_png,
    occlusion_png,
    sky_pngs,
)
from paradize.export.shapes import SKY_FACES, joined, level_quad, mirrored, quad
from paradize.files import resolved
from paradize.formats.glb.bundle import Bundle
from paradize.formats.glb.reader import decode_glb
from paradize.formats.glb.tiles import decode_tile
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.formats.png import encode_png
from paradize.formats.scene.manifest import read_entry, read_scene
from paradize.jobs.progress import OnProgress
from paradize.kinds import BAKED, expecting, require_glb
from paradize.map_table import MAPS
from paradize.metrics.texels import decode_texels
from paradize.placement import to_world
from paradize.preview.shade import to_light, to_srgb
from paradize.scene.motion import moved
from paradize.store.atomic import require_place, write_whole

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]

MOST_BYTES = (1 << 32) - 1  # a GLB's own limit
_SPECULAR = "KHR_materials_specular"
_EMISSIVE = "KHR_materials_emissive_strength"
_UNLIT = "KHR_materials_unlit"
_PLAIN = {  # a material that the scene does not name
    "color": [1.0, 1.0, 1.0],
    "opacity": 1.0,
    "metalness": 0.0,
    "emission": [0.0, 0.0, 0.0],
    "specular": 0.0,
    "smoothness": 0.0,
    "alpha_mode": "opaque",
    "vertex_colors": False,
}
_SEA_ALPHA = 0.35  # low, because the terrain's picture is already darkened by the depth


@dataclass
class Exported:
    """A written file. errors: of the camera's keys, and those of scene.json; notes: what the scene has and
    the file cannot hold."""

    file: Path
    bytes: int = 0
    triangles: int = 0
    pictures: int = 0
    errors: dict[str, float] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def export(folder: Path, out: Path, on_progress: OnProgress | None = None) -> Exported:
    """Writes the scene baked in `folder` (or its scene.json) to the GLB `out`. on_progress hears of each
    part.

    Raises SourceError or FormatError if the folder holds no valid scene; BakeError if the file cannot be
    written, belongs to the scene, has no .glb name, or would be too large."""
    require_glb(out)
    require_place(resolved(out).parent)
    with expecting(BAKED, folder):
        work = _Export(folder)
    if work.holds(out):
        raise BakeError("is a file of the baked scene itself", file=out, mend="name another file with -o")
    parts = [("sky", work.sky), ("terrain", work.terrain), ("water", work.water)]
    parts += [(item["name"], partial(work.objects, item)) for item in work.manifest["objects"]]
    parts += [("light", work.light), ("flight", work.flight)]
    for done, (name, add) in enumerate(parts):
        if on_progress:
            on_progress(name, done, len(parts))
        add()
    exported = Exported(out, errors=work.errors, notes=work.notes)
    exported.triangles, exported.pictures = work.triangles, len(work.bundle.images)
    data = work.bundle.encoded({"scene": work.manifest["name"], "errors": work.errors})
    if len(data) > MOST_BYTES:
        mend = "bake the scene with coarser maps or a larger max_error_m"
        raise BakeError(f"would have {len(data)} bytes, a GLB has at most {MOST_BYTES}", file=out, mend=mend)
    write_whole(out, data)
    exported.bytes = len(data)
    return exported


def _poster_key(manifest: dict[str, Any]) -> dict[str, Any]:
    keys: list[dict[str, Any]] = manifest["daytime"]["keys"]
    return min(keys, key=lambda key: abs(key["at_s"] - manifest["poster_s"]))


def sky_turn(manifest: dict[str, Any]) -> F32:
    """The rotation about Y that brings a sky's light to where it stands at the key nearest to the poster."""
    if not manifest["daytime"]:
        return np.eye(3, dtype=np.float32)
    key = _poster_key(manifest)
    light = max(key["sun"], key["moon"], key=lambda light: light["intensity"])
    angle = light["azimuth_rad"] - key["cubemap_azimuth_rad"]
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]], np.float32)


class _Export:
    """Adds the parts of a scene to a glTF bundle."""

    def __init__(self, folder: Path) -> None:
        path = folder if folder.name == SCENE_FILE else folder / SCENE_FILE
        self.folder = path.parent
        with _reading(path):
            self.manifest = read_scene(path)
        self.keys = flight_keys(self.manifest["flight"])
        self.bundle = Bundle(self.manifest["name"])
        self.triangles = 0
        self._textures: dict[tuple[Any, ...], int] = {}  # by all that they show
        self.errors: dict[str, float] = {}
        self.notes: list[str] = []

    def holds(self, path: Path) -> bool:
        """Whether a path is, or leads to, a file of the scene."""
        path = resolved(path)
        names = {artifact["file"] for artifact in self.manifest["artifacts"].values()}
        return path.name in names and path.parent == resolved(self.folder)

    def sky(self) -> None:
        sky = self.manifest["sky"]
        if not sky:
            return
        pngs = sky_pngs(self._texture(sky["cubemap"]), self.manifest["exposure"])
        half = 0.57 * self.manifest["flight"]["far_m"]  # so that its corners are nearer than the far plane
        turn = sky_turn(self.manifest)
        for name, png, (right, down, ahead) in zip(SKY_FACES, pngs, SKY_FACES.values(), strict=True):
            texture = {"index": self.bundle.texture(f"sky {name}", png, ("clamp", "clamp"))}
            look = {"baseColorTexture": texture, "metallicFactor": 0.0}
            material = self.bundle.material(
                f"sky {name}", pbrMetallicRoughness=look, doubleSided=True, extensions={_UNLIT: {}}
            )
            mesh = quad(*(half * (turn @ np.array(axis, np.float32)) for axis in (ahead, right, down)))
            self._place(f"sky {name}", mesh, {"": material}, self.keys.origin)

    def terrain(self) -> None:
        terrain = self.manifest["terrain"]
        if not terrain:
            return
        meshes: dict[str, Mesh] = {}
        for name in terrain["tiles"]:
            tile = decode_tile(self._read(name), name)
            if finest := [patch.mesh for patch in tile if patch.finest]:  # else finer tiles replace all of it
                meshes[name] = joined(finest)
        effect = decode_texels(self._texture(terrain["effect_color"])) if terrain["effect_color"] else None
        shape = (GROUND_TEXELS, GROUND_TEXELS) if effect is None else at_least(effect.shape[:2])
        heights = terrain_heights(list(meshes.values()), shape)
        share = np.ones(shape, np.float32)
        if effect is not None:
            share = smoothstep(heights, terrain["mix_low_m"], terrain["mix_high_m"])
        sand = contrasted(to_light(decode_texels(self._texture(terrain["sand_color"]))[:, :, :3]))
        size_x, size_z = terrain["size_m"]
        repeat = terrain["sand_repeat"], terrain["sand_repeat"] * size_z / size_x
        light = ground_light(sand, None if effect is None else to_light(effect[:, :, :3]), share, repeat)
        tone = tone_of((size_x, size_z), shape)
        light = toned(light, tone)
        if water := self.manifest["water"]:
            light = wetted(light, tone, heights, terrain, water["level_m"])
            light = under_water(light, heights, water)
        png = encode_png(to_srgb(light))
        color = {"index": self.bundle.texture("ground colour", png, ("clamp", "clamp")), "texCoord": 1}
        look = {
            "baseColorTexture": color,
            "metallicFactor": 0.0,
            "roughnessFactor": 1.0 - terrain["smoothness"],
        }
        parts: dict[str, Any] = {"pbrMetallicRoughness": look}
        if terrain["effect_normal"]:
            png = normal_png(self._texture(terrain["effect_normal"]))
            index = self.bundle.texture("ground normal", png, ("clamp", "clamp"))
            parts["normalTexture"] = {"index": index, "texCoord": 1}
        parts["extensions"] = {_SPECULAR: {"specularFactor": min(1.0, terrain["specular"])}}
        material = self.bundle.material("ground", **parts)
        for name, mesh in meshes.items():
            self._place(name, mesh, {"": material})
        if water:
            self._sea_floor(terrain["height_range_m"][0], water)
        self.notes.append(
            "the ground is one picture: sand is only as fine as its texels, and wet sand does not shine"
        )
        self._note_errors(terrain["tiles"])

    def _sea_floor(self, low_m: float, water: dict[str, Any]) -> None:
        """A plane around the terrain, as dark as its deepest point."""
        dark = np.zeros((1, 1, 3), np.float32)
        deep = under_water(dark, np.full((1, 1), low_m, np.float32), water)[0, 0]
        look = {"baseColorFactor": [*(float(x) for x in deep), 1.0], "metallicFactor": 0.0}
        material = self.bundle.material("sea floor", pbrMetallicRoughness=look)
        self._place("sea floor", level_quad(low_m - 0.05, water["size_m"]), {"": material})

    def water(self) -> None:
        water = self.manifest["water"]
        if not water:
            return
        look = {
            "baseColorFactor": [*water["shallow_color"], _SEA_ALPHA],
            "metallicFactor": 0.0,
            "roughnessFactor": max(0.02, 1.0 - water["smoothness"]),
        }
        png = normal_png(self._texture(water["normal"]))
        normal = {"index": self.bundle.texture("waves", png), "scale": 0.3}
        parts = {"alphaMode": "BLEND", "doubleSided": True, "normalTexture": normal}
        material = self.bundle.material("water", pbrMetallicRoughness=look, **parts)
        mesh = level_quad(water["level_m"], water["size_m"], float(water["wave_repeat"]))
        self._place("water", mesh, {"": material})
        self.notes.append("the sea is a plane: it neither moves, nor mirrors, nor bends light")

    def objects(self, item: dict[str, Any]) -> None:
        used = item["materials"]
        materials = {
            name: self._material(item, name, self._pictures(material)) for name, material in used.items()
        }
        self._note_errors([item["mesh"]])
        mesh = decode_glb(self._read(item["mesh"]), item["mesh"])[0].mesh
        for name in {group.material for group in mesh.groups} - materials.keys():
            materials[name] = self._material(item, name, {})
        plain = {name for name in materials if not used.get(name, _PLAIN)["vertex_colors"]}
        shapes: dict[bool, int] = {}
        if (motion := item["motion"]) is not None:
            share = self.manifest["poster_s"] / self.manifest["flight"]["duration_s"]
            item = item | {
                "instances": [
                    moved(instance, motion, k, share) for k, instance in enumerate(item["instances"])
                ]
            }
            self.notes.append(
                f"{item['name']}: stands where it is at the poster's moment, its wings or legs at rest"
            )
        for k, instance in enumerate(item["instances"]):
            x, y, z = instance["scale"]
            if mirror := x * y * z < 0.0:  # viewers differ on the frames of mirrored nodes
                x = -x
            if mirror not in shapes:
                shape = mirrored(mesh) if mirror else mesh
                shapes[mirror] = self.bundle.mesh(item["name"], shape, materials, plain)
            name = item["name"] if len(item["instances"]) == 1 else f"{item['name']} {k + 1}"
            self.bundle.node(
                name,
                mesh=shapes[mirror],
                translation=[float(value) for value in to_world(mesh.origin, instance)],
                rotation=instance["rotation"],
                scale=[x, y, z],
            )
            self.triangles += len(mesh.triangles)
        if any(material["maps"]["height"] for material in item["materials"].values()):
            self.notes.append(f"{item['name']}: glTF has no parallax; its height map is left out")

    def light(self) -> None:
        sun = self.manifest["sun"]
        back = np.array(sun["direction"], np.float64)
        back /= np.linalg.norm(back)
        up = np.array([0.0, 0.0, -1.0]) if abs(back[1]) > 0.999 else np.array([0.0, 1.0, 0.0])
        right = np.cross(up, back)
        right /= np.linalg.norm(right)
        turn = quaternion(np.stack([right, np.cross(back, right), back], axis=1))
        most = max(1e-6, *sun["color"])
        red, green, blue = (float(channel / most) for channel in sun["color"])
        self.bundle.sun("sun", (red, green, blue), sun["intensity"] * most, [float(x) for x in turn])
        lamps = self.manifest.get("lights", [])
        for lamp in lamps:
            most = max(1e-6, *lamp["color"])
            red, green, blue = (float(channel / most) for channel in lamp["color"])
            power, at = lamp["intensity"] * most, [float(x) for x in lamp["position"]]
            self.bundle.lamp(lamp["name"], (red, green, blue), power, lamp["range_m"], at)
        if any(lamp["hours"] for lamp in lamps):
            self.notes.append("lights that go on and off are always on")
        self.notes.append(
            "glTF holds no ambient light: give the viewer an environment map or an ambient light"
        )
        if self.manifest["daytime"]:
            second_s = _poster_key(self.manifest)["at_s"]
            self.notes.append(
                f"glTF has no time of day: light and sky are those of {second_s:g} s, without clouds"
            )
        for key, what in (("particles", "particles"), ("sounds", "sound"), ("music", "music")):
            if self.manifest[key]:
                self.notes.append(f"glTF has no {what}")

    def flight(self) -> None:
        path = self.manifest["flight"]
        width, height = self.manifest["viewport"]
        node = self.bundle.camera(
            "camera",
            aspect=width / height,
            fov_rad=path["fov_rad"],
            near_m=path["near_m"],
            far_m=path["far_m"],
        )
        keys = self.keys
        self.bundle.nodes[node] |= {
            "translation": [float(x) for x in keys.places[0]],
            "rotation": [float(x) for x in keys.turns[0]],
        }
        self.bundle.animation("flight", node, keys.times_s, keys.places, keys.turns)
        if keys.origin != ORIGIN:  # keys are float32, a node's numbers are not
            self.bundle.node("camera's place", translation=list(keys.origin), children=[node])
        self.errors |= keys.errors

    def _pictures(self, material: dict[str, Any]) -> dict[str, dict[str, int]]:
        """The texture infos of a material's maps, by kind: "gloss" holds metalness too. What lies on second
        texture coordinates stands in place of what lies on first ones; metalness goes with gloss."""
        second = material.get("second", {"maps": {}})
        maps = material["maps"] | {key: name for key, name in second["maps"].items() if name}
        smoothness, gloss, occlusion = material["smoothness"], maps["gloss"], maps["occlusion"]
        beside = second["maps"] if gloss and gloss != material["maps"]["gloss"] else material["maps"]
        metal = beside["occlusion"]
        metal = metal if metal and _has_metal(self._texture(metal)) else None
        wanted: list[tuple[str, tuple[str | None, ...], Callable[..., bytes]]] = [
            ("color", (maps["color"],), color_png),
            ("normal", (maps["normal"],), normal_png),
            ("occlusion", (occlusion,), occlusion_png),
            ("emission", (maps["emission"],), color_png),
        ]
        if material["specular"] > 0.0 or material["metalness"] > 0.0:
            wanted.append(("gloss", (gloss, metal), partial(gloss_png, smoothness=smoothness)))
        textures: dict[str, dict[str, int]] = {}
        for kind, names, encode in wanted:
            if known := [name for name in names if name]:
                on_second = known[0] in second["maps"].values()
                wrap = second["wrap"] if on_second else material["wrap"] or ["clamp", "clamp"]
                sampler = wrap, material["nearest"]
                key = kind, *names, str(sampler), smoothness if kind == "gloss" else None
                if key not in self._textures:
                    png = encode(*(self._texture(name) if name else None for name in names))
                    label = " ".join(known).replace("_", " ")
                    mips = all(self.manifest["artifacts"][name]["max_level"] != 0 for name in known)
                    self._textures[key] = self.bundle.texture(label, png, *sampler, mips=mips)
                    self._note_errors(known)
                textures[kind] = {"index": self._textures[key]} | ({"texCoord": 1} if on_second else {})
        return textures

    def _material(self, item: dict[str, Any], name: str, pictures: dict[str, dict[str, int]]) -> int:
        material = item["materials"].get(name, _PLAIN)
        look: dict[str, Any] = {
            "baseColorFactor": [*material["color"], material["opacity"]],
            "metallicFactor": material["metalness"],
        }
        parts: dict[str, Any] = {"pbrMetallicRoughness": look}
        if "color" in pictures:
            look["baseColorTexture"] = pictures["color"]
        if "normal" in pictures:
            parts["normalTexture"] = pictures["normal"]
        if "occlusion" in pictures:
            parts["occlusionTexture"] = pictures["occlusion"] | {"strength": material["occlusion_strength"]}
        # Seen straight on, ours reflects 0.08 of the specular intensity, glTF 0.04 of the factors.
        shine: dict[str, Any] = {"specularColorFactor": [2.0 * material["specular"]] * 3}
        if "gloss" in pictures:
            look["metallicRoughnessTexture"] = pictures["gloss"]
        second = material.get("second", {"maps": {"gloss": None}})["maps"]
        if "gloss" in pictures and (material["maps"]["gloss"] or second["gloss"]):
            shine["specularTexture"] = pictures["gloss"]
        else:
            look["roughnessFactor"] = 1.0 - material["smoothness"]
        parts["extensions"] = {_SPECULAR: shine} | _emission(parts, material["emission"], pictures)
        if material.get("unlit") and max(material["emission"]) <= 1.0:
            parts = _unlit(material, pictures)
        if material.get("two_sided"):
            parts["doubleSided"] = True
        if material["alpha_mode"] == "mask":
            parts |= {"alphaMode": "MASK", "alphaCutoff": material["alpha_cutoff"]}
        elif material["alpha_mode"] == "blend":
            parts["alphaMode"] = "BLEND"
        return self.bundle.material(f"{item['name']} {name}".strip(), **parts)

    def _place(self, name: str, mesh: Mesh, materials: dict[str, int], at: Vec3 = ORIGIN) -> None:
        stand = {} if at == ORIGIN else {"translation": list(at)}
        self.bundle.node(name, mesh=self.bundle.mesh(name, mesh, materials), **stand)
        self.triangles += len(mesh.triangles)

    def _note_errors(self, names: list[str]) -> None:
        """Keeps the errors of these artifacts from the manifest."""
        for name in names:
            artifact = self.manifest["artifacts"][name]
            for metric in ("terrain_max_m", "color_psnr_db", "normal_p99_deg"):
                if metric in artifact["errors"]:
                    self.errors[f"{name} {metric}"] = artifact["errors"][metric]

    def _texture(self, name: str) -> Texture:
        return decode_ktx2(self._read(name), name)

    def _file(self, name: str) -> Path:
        return self.folder / str(self.manifest["artifacts"][name]["file"])

    def _read(self, name: str) -> bytes:
        with _reading(self._file(name)):
            return read_entry(self.folder, self.manifest["artifacts"][name])


def _has_metal(occlusion: Texture) -> bool:
    """Whether a map of occlusion has metalness beside it."""
    return occlusion.format not in MAPS["occlusion"].narrow_formats


def _emission(
    parts: dict[str, Any], light: Sequence[float], pictures: Mapping[str, dict[str, int]]
) -> dict[str, Any]:
    """Writes what a material gives off into its parts; returns the extension for more than 1."""
    strongest = max(light)
    if strongest <= 0.0:
        return {}
    parts["emissiveFactor"] = [channel / max(1.0, strongest) for channel in light]
    if "emission" in pictures:
        parts["emissiveTexture"] = pictures["emission"]
    return {_EMISSIVE: {"emissiveStrength": strongest}} if strongest > 1.0 else {}


def _unlit(material: dict[str, Any], pictures: Mapping[str, dict[str, int]]) -> dict[str, Any]:
    """The parts of a material that gives off its colour, which vertex colours multiply."""
    look: dict[str, Any] = {"baseColorFactor": [*material["emission"], material["opacity"]]}
    if picture := pictures.get("color") or pictures.get("emission"):  # only that of the colour has alpha
        look["baseColorTexture"] = picture
    return {"pbrMetallicRoughness": look, "extensions": {_UNLIT: {}}}


@contextmanager
def _reading(path: Path) -> Iterator[None]:
    """Raises SourceError if a file of the scene cannot be read."""
    try:
        yield
    except OSError as error:
        raise unread(error, path, "bake the scene again") from None
