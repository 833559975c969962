"""The shape of a mesh at rest: morph targets at their default weights, skins as their joints stand."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from paradize.readers.gltf.accessors import FLOAT, Accessors
from paradize.readers.gltf.document import Document
from paradize.readers.gltf.nodes import Matrix, Nodes, product
from paradize.readers.gltf.primitives import Primitive

if TYPE_CHECKING:
    from paradize.data import F64


def morphed(read: Primitive, weights: tuple[float, ...]) -> Primitive:
    """The primitive with its morph targets added."""
    values = dict(read.values)
    for weight, target in zip(weights, read.targets, strict=False):
        if weight:
            for name, rows in target.items():
                if name in values:
                    values[name] = values[name] + weight * rows
    return replace(read, values=values, targets=[])


def default_weights(document: Document, node: int, mesh: int) -> tuple[float, ...]:
    """The weights of a node's morph targets: its own, else its mesh's; without zeros at the end."""
    for table, index in (("nodes", node), ("meshes", mesh)):
        if index < 0:
            continue
        entry, place = document.item(table, index, ""), f"/{table}/{index}"
        if document.get(entry, place, "weights", list, None) is not None:
            weights = document.floats(entry, place, "weights", len(entry["weights"]), ())
            while weights and not weights[-1]:
                weights = weights[:-1]
            return weights
    return ()


def joints_of(document: Document, accessors: Accessors, nodes: Nodes, skin: int, where: str) -> list[Matrix]:
    """The matrix of each joint of a skin: from the mesh as it was bound to where the joint stands."""
    place = f"/skins/{skin}"
    entry = document.item("skins", skin, where)
    joints = document.wholes(entry, place, "joints")
    for joint in joints:
        document.item("nodes", joint, f"{place}/joints")
    number = document.get(entry, place, "inverseBindMatrices", int, None)
    if number is None:
        return [nodes.world[joint] for joint in joints]
    rows = accessors.floats(number, f"{place}/inverseBindMatrices", (16,), (FLOAT,))
    if len(rows) < len(joints):
        raise document.fault(f"{len(rows)} matrices for {len(joints)} joints", f"{place}/inverseBindMatrices")
    if not np.isfinite(rows).all():
        raise document.fault("matrices that are not finite", f"{place}/inverseBindMatrices")
    inverse = [tuple(m[column * 4 + row] for row in range(3) for column in range(4)) for m in rows.tolist()]
    return [product(nodes.world[joint], bound) for joint, bound in zip(joints, inverse, strict=False)]


@np.errstate(over="ignore", invalid="ignore")  # positions beyond float32 are refused later
def vertex_matrices(document: Document, read: Primitive, joints: list[Matrix], place: str) -> F64 | None:
    """(n, 12): the matrix of each vertex of a skinned primitive; None where it has no joints."""
    sets = sum(f"JOINTS_{k}" in read.values and f"WEIGHTS_{k}" in read.values for k in range(8))
    if not sets or not joints:
        return None
    matrices = np.array(joints)
    count = len(read.values["POSITION"])
    out, total = np.zeros((count, 12)), np.zeros(count)
    for k in range(sets):
        if f"JOINTS_{k}" not in read.values or f"WEIGHTS_{k}" not in read.values:
            break
        numbers, weights = read.values[f"JOINTS_{k}"].astype(np.int64), read.values[f"WEIGHTS_{k}"]
        if int(numbers[weights > 0.0].max(initial=0)) >= len(joints):
            what = f"joint {int(numbers.max())} of {len(joints)}"
            raise document.fault(what, f"{place}/attributes/JOINTS_{k}")
        numbers = np.where(weights > 0.0, numbers, 0)
        for column in range(4):
            share = np.maximum(weights[:, column], 0.0)
            out += share[:, None] * matrices[numbers[:, column]]
            total += share
    free = ~(total > 0.0)
    if free.any():
        document.warn(f"{int(free.sum())} vertices of a skin without weights follow its first joint", place)
        out[free], total[free] = matrices[0], 1.0
    return np.asarray(out / total[:, None])
