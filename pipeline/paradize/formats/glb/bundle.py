"""A GLB that carries everything: meshes, pictures, lights, cameras and their movement, for `paradize export`.

Source: The Khronos Group, "glTF 2.0 Specification", 2021; its extensions KHR_lights_punctual,
KHR_materials_specular and KHR_materials_unlit. What a scene of ours needs of them, and no more.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.formats.glb.layout import FLOAT
from paradize.formats.glb.writer import Writer, joined

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Mesh

    F32 = npt.NDArray[np.float32]

_REPEAT, _CLAMP, _LINEAR, _LINEAR_MIPMAPS = 10497, 33071, 9729, 9987
_LIGHTS = "KHR_lights_punctual"


@dataclass
class Bundle:
    """A document that grows; every method appends one thing and returns its index."""

    name: str
    writer: Writer = field(default_factory=Writer)
    images: list[dict[str, Any]] = field(default_factory=list)
    textures: list[dict[str, Any]] = field(default_factory=list)
    materials: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    nodes: list[dict[str, Any]] = field(default_factory=list)
    cameras: list[dict[str, Any]] = field(default_factory=list)
    lights: list[dict[str, Any]] = field(default_factory=list)
    animations: list[dict[str, Any]] = field(default_factory=list)
    extensions: set[str] = field(default_factory=set)

    def texture(self, name: str, png: bytes, *, repeat: bool) -> int:
        """A PNG, sampled with mips; repeated or with its edges held."""
        view = self._raw(np.frombuffer(png, np.uint8))
        self.images.append({"name": name, "mimeType": "image/png", "bufferView": view})
        self.textures.append({"source": len(self.images) - 1, "sampler": 0 if repeat else 1})
        return len(self.textures) - 1

    def material(self, name: str, **parts: Any) -> int:
        """A material of glTF's own properties; the extensions that it uses are noted."""
        self.extensions |= parts.get("extensions", {}).keys()
        self.materials.append({"name": name, **parts})
        return len(self.materials) - 1

    def mesh(self, name: str, mesh: Mesh, materials: dict[str, int]) -> int:
        """A primitive for each run of a material. materials: by the groups' names, or one for all as ""."""
        attributes = self.writer.vertices(mesh)
        view, component, width = self.writer.indices(mesh)
        runs = [(group.material, 3 * group.first, 3 * group.count) for group in mesh.groups]
        primitives = []
        for material, first, count in runs or [("", 0, mesh.triangles.size)]:
            corners = self.writer.accessor(view, component, count, "SCALAR", byteOffset=width * first)
            used = materials[material] if material in materials else materials[""]
            primitives.append({"attributes": attributes, "indices": corners, "material": used})
        self.meshes.append({"name": name, "primitives": primitives})
        return len(self.meshes) - 1

    def node(self, name: str, **parts: Any) -> int:
        self.nodes.append({"name": name, **parts})
        return len(self.nodes) - 1

    def camera(self, name: str, *, aspect: float, fov_rad: float, near_m: float, far_m: float) -> int:
        """A node with a perspective camera; fov_rad: vertical."""
        seen = {"aspectRatio": aspect, "yfov": fov_rad, "znear": near_m, "zfar": far_m}
        self.cameras.append({"name": name, "type": "perspective", "perspective": seen})
        return self.node(name, camera=len(self.cameras) - 1)

    def sun(self, name: str, color: tuple[float, float, float], lux: float, turn: list[float]) -> int:
        """A node with light from infinitely far, along -Z turned by a quaternion (x, y, z, w)."""
        light = {"name": name, "type": "directional", "color": list(color), "intensity": lux}
        self.lights.append(light)
        self.extensions.add(_LIGHTS)
        return self.node(name, rotation=turn, extensions={_LIGHTS: {"light": len(self.lights) - 1}})

    def movement(self, name: str, node: int, times_s: F32, places: F32, turns: F32) -> None:
        """An animation of a node: times (n,), rising from 0; places (n, 3) in metres; unit quaternions
        (n, 4), x y z w; between them straight lines and great circles."""
        view = self._raw(times_s)
        low, high = [float(times_s[0])], [float(times_s[-1])]
        clock = self.writer.accessor(view, FLOAT, len(times_s), "SCALAR", min=low, max=high)
        samplers, channels = [], []
        for path, values, shape in (("translation", places, "VEC3"), ("rotation", turns, "VEC4")):
            output = self.writer.accessor(self._raw(values), FLOAT, len(values), shape)
            samplers.append({"input": clock, "output": output, "interpolation": "LINEAR"})
            channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})
        self.animations.append({"name": name, "samplers": samplers, "channels": channels})

    def encoded(self, extras: dict[str, Any]) -> bytes:
        """The file. Its scene holds all nodes that are no children; extras stand in `asset`."""
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "paradize", "extras": extras},
            "scene": 0,
            "scenes": [{"name": self.name, "nodes": self._roots()}],
        }
        if self.extensions:
            document["extensionsUsed"] = sorted(self.extensions)
        if self.lights:
            document["extensions"] = {_LIGHTS: {"lights": self.lights}}
        if self.textures:
            filters = {"magFilter": _LINEAR, "minFilter": _LINEAR_MIPMAPS}
            wraps = ({"wrapS": wrap, "wrapT": wrap} for wrap in (_REPEAT, _CLAMP))
            document["samplers"] = [filters | wrap for wrap in wraps]
        for key in ("nodes", "meshes", "materials", "textures", "images", "cameras", "animations"):
            if found := getattr(self, key):
                document[key] = found
        binary = self.writer.binary
        binary += b"\0" * (-len(binary) % 4)
        document |= {"accessors": self.writer.accessors, "bufferViews": self.writer.views}
        document["buffers"] = [{"byteLength": len(binary)}]
        return joined(json.dumps(document, separators=(",", ":"), allow_nan=False).encode(), binary)

    def _roots(self) -> list[int]:
        inner = {child for node in self.nodes for child in node.get("children", [])}
        return [at for at in range(len(self.nodes)) if at not in inner]

    def _raw(self, values: npt.NDArray[Any]) -> int:
        """A view of bytes that no vertex shader reads."""
        binary = self.writer.binary
        binary += b"\0" * (-len(binary) % 16)
        raw = np.ascontiguousarray(values)
        self.writer.views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": raw.nbytes})
        binary += raw.reshape(-1).view(np.uint8).data
        return len(self.writer.views) - 1
