"""A GLB with meshes, pictures, lights, cameras and animations, for `paradize export`.

Source: The Khronos Group, "glTF 2.0 Specification", 2021, with KHR_lights_punctual, KHR_materials_specular
and KHR_materials_unlit. Only the parts that our scenes need.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.formats.glb.layout import FLOAT
from paradize.formats.glb.writer import Writer, join_chunks
from paradize.material import REPEATED, Wrap

if TYPE_CHECKING:
    import numpy.typing as npt

    from paradize.data import Mesh

    F32 = npt.NDArray[np.float32]

_WRAPS: dict[Wrap, int] = {"repeat": 10497, "clamp": 33071, "mirror": 33648}
_NEAREST, _LINEAR, _LINEAR_MIPMAPS = 9728, 9729, 9987
_LIGHTS = "KHR_lights_punctual"


@dataclass
class Bundle:
    """A glTF document under construction. Each method appends one item and returns its index."""

    name: str
    writer: Writer = field(default_factory=Writer)
    images: list[dict[str, Any]] = field(default_factory=list)
    textures: list[dict[str, Any]] = field(default_factory=list)
    samplers: list[dict[str, Any]] = field(default_factory=list)
    materials: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    nodes: list[dict[str, Any]] = field(default_factory=list)
    cameras: list[dict[str, Any]] = field(default_factory=list)
    lights: list[dict[str, Any]] = field(default_factory=list)
    animations: list[dict[str, Any]] = field(default_factory=list)
    extensions: set[str] = field(default_factory=set)

    def texture(
        self,
        name: str,
        png: bytes,
        wrap: Sequence[Wrap] = REPEATED,
        nearest: bool = False,
        *,
        mips: bool = True,
    ) -> int:
        """Appends a PNG. wrap: what lies beyond its edges, along u and v. nearest: whether enlarged texels
        are squares. mips: whether it is sampled with them."""
        u, v = (_WRAPS[way] for way in wrap)
        sampler = {
            "magFilter": _NEAREST if nearest else _LINEAR,
            "minFilter": _LINEAR_MIPMAPS if mips else _LINEAR,
        }
        sampler |= {"wrapS": u, "wrapT": v}
        if sampler not in self.samplers:
            self.samplers.append(sampler)
        view = self._raw(np.frombuffer(png, np.uint8))
        self.images.append({"name": name, "mimeType": "image/png", "bufferView": view})
        self.textures.append({"source": len(self.images) - 1, "sampler": self.samplers.index(sampler)})
        return len(self.textures) - 1

    def material(self, name: str, **parts: Any) -> int:
        """Appends a material of glTF properties and records the extensions that it uses."""
        self.extensions |= parts.get("extensions", {}).keys()
        self.materials.append({"name": name, **parts})
        return len(self.materials) - 1

    def mesh(
        self, name: str, mesh: Mesh, materials: dict[str, int], plain: Collection[str] = frozenset()
    ) -> int:
        """Appends a mesh with one primitive per group. materials: index by material name, or one for all as
        "". plain: materials that the mesh's vertex colours do not reach."""
        attributes = self.writer.vertices(mesh)
        view, component, width = self.writer.indices(mesh)
        runs = [(group.material, 3 * group.first, 3 * group.count) for group in mesh.groups]
        primitives = []
        for material, first, count in runs or [("", 0, mesh.triangles.size)]:
            corners = self.writer.accessor(view, component, count, "SCALAR", byteOffset=width * first)
            used = materials[material] if material in materials else materials[""]
            drawn = {key: at for key, at in attributes.items() if key != "COLOR_0" or material not in plain}
            primitives.append({"attributes": drawn, "indices": corners, "material": used})
        self.meshes.append({"name": name, "primitives": primitives})
        return len(self.meshes) - 1

    def node(self, name: str, **parts: Any) -> int:
        self.nodes.append({"name": name, **parts})
        return len(self.nodes) - 1

    def camera(self, name: str, *, aspect: float, fov_rad: float, near_m: float, far_m: float) -> int:
        """Appends a node with a perspective camera. fov_rad: vertical."""
        projection = {"aspectRatio": aspect, "yfov": fov_rad, "znear": near_m, "zfar": far_m}
        self.cameras.append({"name": name, "type": "perspective", "perspective": projection})
        return self.node(name, camera=len(self.cameras) - 1)

    def sun(self, name: str, color: tuple[float, float, float], lux: float, turn: list[float]) -> int:
        """Appends a node with a directional light along -Z, rotated by the quaternion `turn` (x, y, z, w)."""
        light = {"name": name, "type": "directional", "color": list(color), "intensity": lux}
        self.lights.append(light)
        self.extensions.add(_LIGHTS)
        return self.node(name, rotation=turn, extensions={_LIGHTS: {"light": len(self.lights) - 1}})

    def lamp(
        self, name: str, color: tuple[float, float, float], candela: float, range_m: float, at: list[float]
    ) -> int:
        """Appends a node with a point light at a place."""
        light = {"name": name, "type": "point", "color": list(color), "intensity": candela, "range": range_m}
        self.lights.append(light)
        self.extensions.add(_LIGHTS)
        return self.node(name, translation=at, extensions={_LIGHTS: {"light": len(self.lights) - 1}})

    def animation(self, name: str, node: int, times_s: F32, positions: F32, rotations: F32) -> None:
        """Appends a linear animation of a node. times_s: (n,), rising from 0. positions: (n, 3), metres.
        rotations: (n, 4), unit quaternions x y z w."""
        view = self._raw(times_s)
        low, high = [float(times_s[0])], [float(times_s[-1])]
        times = self.writer.accessor(view, FLOAT, len(times_s), "SCALAR", min=low, max=high)
        samplers, channels = [], []
        for path, values, shape in (("translation", positions, "VEC3"), ("rotation", rotations, "VEC4")):
            output = self.writer.accessor(self._raw(values), FLOAT, len(values), shape)
            samplers.append({"input": times, "output": output, "interpolation": "LINEAR"})
            channels.append({"sampler": len(samplers) - 1, "target": {"node": node, "path": path}})
        self.animations.append({"name": name, "samplers": samplers, "channels": channels})

    def encoded(self, extras: dict[str, Any]) -> bytes:
        """The file's bytes. Its scene holds all nodes that are not children. extras are stored in `asset`."""
        document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "paradize", "extras": extras},
            "scene": 0,
            "scenes": [{"name": self.name, "nodes": self._roots()}],
        }
        if self.extensions:
            document["extensionsUsed"] = sorted(self.extensions)
        if self.lights:
            document["extensions"] = {_LIGHTS: {"lights": self.lights}}
        for key in (
            "samplers",
            "nodes",
            "meshes",
            "materials",
            "textures",
            "images",
            "cameras",
            "animations",
        ):
            if items := getattr(self, key):
                document[key] = items
        binary = self.writer.binary
        binary += b"\0" * (-len(binary) % 4)
        document |= {"accessors": self.writer.accessors, "bufferViews": self.writer.views}
        document["buffers"] = [{"byteLength": len(binary)}]
        return join_chunks(json.dumps(document, separators=(",", ":"), allow_nan=False).encode(), binary)

    def _roots(self) -> list[int]:
        children = {child for node in self.nodes for child in node.get("children", [])}
        return [index for index in range(len(self.nodes)) if index not in children]

    def _raw(self, values: npt.NDArray[Any]) -> int:
        """Appends a buffer view without a target (not vertex data)."""
        binary = self.writer.binary
        binary += b"\0" * (-len(binary) % 16)
        raw = np.ascontiguousarray(values)
        self.writer.views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": raw.nbytes})
        binary += raw.reshape(-1).view(np.uint8).data
        return len(self.writer.views) - 1
