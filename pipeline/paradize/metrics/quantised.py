"""The error of quantisation: vertices decoded from a GLB as glTF prescribes, against the original vertices,
in float64.

Reads the bytes of the file with a reader of its own, independent of the writer: positions by the node's
translation and scale, tangents by its scale, normals by the inverse scale.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from paradize.data import Mesh, rounded, rounded_up
from paradize.documents import parse_json
from paradize.kernels.reference import angles_deg
from paradize.metrics.surface import diagonal

F64 = npt.NDArray[np.float64]
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5126: "<f4"}
_WIDTHS = {"VEC2": 2, "VEC3": 3, "VEC4": 4}


def quantised_errors(glb: bytes, sources: Sequence[Mesh]) -> list[dict[str, float]]:
    """The errors of each node's vertices, in the order of the nodes.

    Every vertex is measured. Inside a triangle positions, UVs and colours are linear, so quantise_max,
    quantise_uv_max and quantise_color_max hold for every point; they are rounded upwards.

    sources: the original meshes, vertices in the file's order; the diagonal is that of the first.
    quantise_max, quantise_p99, quantise_rms: distance of vertices relative to the diagonal. quantise_max_m:
    in metres. quantise_normal_max_deg, _p99_deg, _mean_deg and quantise_tangent_...: angles. quantise_uv_max:
    difference of UVs. quantise_color_max: difference of linear colour values. 0 for attributes that are
    missing. quantise_sway_max: difference of sway, of a mesh that has any.
    """
    (length,) = struct.unpack_from("<I", glb, 12)
    tree = parse_json(glb[20 : 20 + length])
    binary = memoryview(glb)[28 + length :]
    diagonal_m = diagonal(sources[0])
    results = []
    for node, source in zip(tree["nodes"], sources, strict=True):
        scale = np.array(node.get("scale", [1.0, 1.0, 1.0]))
        origin = np.array(node.get("translation", [0.0, 0.0, 0.0]))
        names = tree["meshes"][node["mesh"]]["primitives"][0]["attributes"]
        arrays = {name: _values(tree, binary, index) for name, index in names.items()}
        distances = _distances(origin - source.origin + arrays["POSITION"] * scale, source.positions)
        errors = {
            "quantise_max": _relative(distances.max(), diagonal_m),
            "quantise_p99": _relative(_p99(distances), diagonal_m),
            "quantise_rms": _relative(_rms(distances), diagonal_m),
            "quantise_max_m": float(distances.max()),
        }
        largest_scale = scale.max()
        errors |= _direction_errors("normal", arrays.get("NORMAL"), source.normals, scale.min() / scale)
        errors |= _direction_errors("tangent", arrays.get("TANGENT"), source.tangents, scale / largest_scale)
        errors["quantise_uv_max"] = max(
            _largest(arrays.get("TEXCOORD_0"), source.uvs),
            _largest(arrays.get("TEXCOORD_1"), source.uvs1),
        )
        errors["quantise_color_max"] = _largest(arrays.get("COLOR_0"), source.colors)
        if source.sway is not None:
            errors["quantise_sway_max"] = _largest(arrays.get("_SWAY"), source.sway)
        results.append(
            {key: (rounded_up if "_max" in key else rounded)(value) for key, value in errors.items()}
        )
    return results


def _values(tree: dict[str, Any], binary: memoryview, index: int) -> F64:
    """An accessor as float64 (n, k), normalized integers decoded."""
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


def _distances(decoded: F64, source: npt.NDArray[np.float32]) -> F64:
    difference = np.abs(decoded - source.astype(np.float64))
    largest = difference.max(axis=1)
    scale = np.where(largest > 0.0, largest, 1.0)[:, None]  # scaled: squares would underflow or overflow
    x, y, z = (difference / scale).T
    return np.asarray(largest * np.sqrt(x * x + y * y + z * z), np.float64)


def _relative(value: float, diagonal_m: float) -> float:
    return float(value) / diagonal_m if diagonal_m > 0.0 else 0.0


def _p99(values: F64) -> float:
    index = min(len(values) - 1, math.ceil(0.99 * len(values)))
    return float(np.partition(values, index)[index])


def _rms(values: F64) -> float:
    largest = float(values.max())
    if largest == 0.0:
        return 0.0
    return largest * math.sqrt(math.fsum(((values / largest) ** 2).tolist()) / len(values))


def _direction_errors(
    name: str, decoded: F64 | None, source: npt.NDArray[np.float32] | None, factor: F64
) -> dict[str, float]:
    """Angles between decoded and original directions. factor: (3,), converts directions of the node to world
    space, its largest component 1."""
    keys = [f"quantise_{name}_{part}_deg" for part in ("max", "p99", "mean")]
    if decoded is None or source is None:
        return dict.fromkeys(keys, 0.0)
    directions = np.ascontiguousarray(decoded[:, :3] * factor)
    # The kernel accepts any length, but float32 has no tiny ones.
    directions /= np.maximum(np.abs(directions).max(axis=1), 1e-300)[:, None]
    angles = angles_deg(directions, np.ascontiguousarray(source[:, :3], np.float64))
    if decoded.shape[1] == 4:  # a changed sign mirrors the frame
        angles = np.where(decoded[:, 3] == source[:, 3], angles, 180.0)
    values = (float(angles.max()), _p99(angles), math.fsum(angles.tolist()) / len(angles))
    return dict(zip(keys, values, strict=True))


def _largest(decoded: F64 | None, source: npt.NDArray[np.float32] | None) -> float:
    if decoded is None or source is None:
        return 0.0
    return float(np.abs(decoded - source.astype(np.float64)).max())
