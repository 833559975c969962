"""What the codes of a quantised GLB cost: its vertices, as glTF says that a viewer places them, against those
that were quantised, in float64.

It sees the bytes of the file alone, through a reader of its own, which takes no part in writing them:
positions by the node's translation and scale, tangents by its scale, normals by the inverse of it.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, six, six_up
from paradize.documents import parse_json
from paradize.kernels.reference import angles_deg
from paradize.metrics.surface import diagonal

F64 = npt.NDArray[np.float64]
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5126: "<f4"}
_WIDTHS = {"VEC2": 2, "VEC3": 3, "VEC4": 4}


def quantised_errors(glb: bytes, sources: Sequence[Mesh]) -> list[dict[str, float]]:
    """The errors of each node's vertices, in the order of the nodes.

    Every vertex is looked at, none is sampled; between the vertices of a triangle positions, texture
    coordinates and colours are linear, so that no point of it moved farther than quantise_max,
    quantise_uv_max and quantise_color_max say. Those are rounded upwards.

    sources: the meshes that were quantised, their vertices in the file's order; the diagonal is the first
    one's. Keys: quantise_max, quantise_p99, quantise_rms: how far vertices moved, of the diagonal;
    quantise_max_m: the first in metres; quantise_normal_max_deg, _p99_deg, _mean_deg and
    quantise_tangent_...: angles between directions; quantise_uv_max: how far the texture moved along one of
    its sides, of that side; quantise_color_max: difference of linear values. 0 of what is not there.
    """
    (length,) = struct.unpack_from("<I", glb, 12)
    tree = parse_json(glb[20 : 20 + length])
    binary = memoryview(glb)[28 + length :]
    across = diagonal(sources[0])
    found = []
    for node, source in zip(tree["nodes"], sources, strict=True):
        scale = np.array(node.get("scale", [1.0, 1.0, 1.0]))
        origin = np.array(node.get("translation", [0.0, 0.0, 0.0]))
        names = tree["meshes"][node["mesh"]]["primitives"][0]["attributes"]
        arrays = {name: _values(tree, binary, index) for name, index in names.items()}
        moved = _moved(origin - source.origin + arrays["POSITION"] * scale, source.positions)
        errors = {
            "quantise_max": _share(moved.max(), across),
            "quantise_p99": _share(_p99(moved), across),
            "quantise_rms": _share(_rms(moved), across),
            "quantise_max_m": float(moved.max()),
        }
        widest = scale.max()
        errors |= _turned("normal", arrays.get("NORMAL"), source.normals, scale.min() / scale)
        errors |= _turned("tangent", arrays.get("TANGENT"), source.tangents, scale / widest)
        errors["quantise_uv_max"] = max(
            _most(arrays.get("TEXCOORD_0"), source.uvs), _most(arrays.get("TEXCOORD_1"), source.uvs1)
        )
        errors["quantise_color_max"] = _most(arrays.get("COLOR_0"), source.colors)
        found.append({key: (six_up if "_max" in key else six)(value) for key, value in errors.items()})
    return found


def _values(tree: dict[str, Any], binary: memoryview, index: int) -> F64:
    """An accessor as numbers (n, k), normalized ones as what they stand for."""
    entry = tree["accessors"][index]
    view = tree["bufferViews"][entry["bufferView"]]
    kind, width = np.dtype(_TYPES[entry["componentType"]]), _WIDTHS[entry["type"]]
    stride = view.get("byteStride", kind.itemsize * width)
    start = view.get("byteOffset", 0) + entry.get("byteOffset", 0)
    strides = (stride, kind.itemsize)
    raw = np.ndarray((entry["count"], width), kind, binary, start, strides).astype(np.float64)
    if entry.get("normalized", False):
        raw = np.maximum(raw / float(np.iinfo(kind).max), -1.0)
    return raw


def _moved(found: F64, source: npt.NDArray[np.float32]) -> F64:
    off = np.abs(found - source.astype(np.float64))
    largest = off.max(axis=1)
    scale = np.where(largest > 0.0, largest, 1.0)[:, None]  # squares of 1e-200 and 1e200 are none
    x, y, z = (off / scale).T
    return np.asarray(largest * np.sqrt(x * x + y * y + z * z), np.float64)


def _share(value: float, across: float) -> float:
    return float(value) / across if across > 0.0 else 0.0


def _p99(values: F64) -> float:
    last = min(len(values) - 1, math.ceil(0.99 * len(values)))
    return float(np.partition(values, last)[last])


def _rms(values: F64) -> float:
    most = float(values.max())
    if most == 0.0:
        return 0.0
    return most * math.sqrt(math.fsum(((values / most) ** 2).tolist()) / len(values))


def _turned(
    name: str, found: F64 | None, source: npt.NDArray[np.float32] | None, stretch: F64
) -> dict[str, float]:
    """stretch: what turns the node's directions into the world's, its largest number 1."""
    keys = [f"quantise_{name}_{part}_deg" for part in ("max", "p99", "mean")]
    if found is None or source is None:
        return dict.fromkeys(keys, 0.0)
    there = np.ascontiguousarray(found[:, :3] * stretch)
    # The kernel takes directions of any length, but float32 holds no tiny ones.
    there /= np.maximum(np.abs(there).max(axis=1), 1e-300)[:, None]
    angles = angles_deg(there, np.ascontiguousarray(source[:, :3], np.float64))
    if found.shape[1] == 4:  # a sign that changed turns the frame inside out
        angles = np.where(found[:, 3] == source[:, 3], angles, 180.0)
    told = (float(angles.max()), _p99(angles), math.fsum(angles.tolist()) / len(angles))
    return dict(zip(keys, told, strict=True))


def _most(found: F64 | None, source: npt.NDArray[np.float32] | None) -> float:
    if found is None or source is None:
        return 0.0
    return float(np.abs(found - source.astype(np.float64)).max())
