"""Where the nodes of a glTF model stand: world matrices, and the nodes that its scene shows.

Matrices are 3 x 4, row by row, in float64: sums and products of Python's floats, the same on every machine.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite, sqrt
from typing import TYPE_CHECKING

from paradize.placement import IDENTITY
from paradize.readers.gltf.accessors import Accessors
from paradize.readers.gltf.document import Document

if TYPE_CHECKING:
    from paradize.data import F64

Matrix = tuple[float, ...]  # 12 numbers
_ROUNDED = 0.01  # how far from 1 the length of a rotation may be in quantised and rounded files
INSTANCING = "EXT_mesh_gpu_instancing"


class Nodes:
    """The tree of nodes. world: matrix by node, of all that hang on a root. copies: instances read so far of
    nodes that have several."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.copies = 0
        count = len(document.table("nodes"))
        self._children: list[list[int]] = []
        parent: dict[int, int] = {}
        for index in range(count):
            place = f"/nodes/{index}"
            children = document.wholes(document.item("nodes", index, place), place, "children")
            for child in children:
                document.item("nodes", child, f"{place}/children")
                if child in parent:
                    what = f"node {child} hangs on node {parent[child]} already"
                    raise document.fault(what, f"{place}/children")
                parent[child] = index
            self._children.append(children)
        self._roots = [index for index in range(count) if index not in parent]
        self.world: dict[int, Matrix] = {}
        waiting = [(index, IDENTITY) for index in self._roots]
        while waiting:
            index, above = waiting.pop()
            matrix = product(above, self._local(index))
            self.world[index] = matrix
            waiting += [(child, matrix) for child in self._children[index]]
        if len(self.world) < count:
            lost = next(index for index in range(count) if index not in self.world)
            raise document.fault("the node hangs on itself", f"/nodes/{lost}")

    def shown(self) -> list[int]:
        """The nodes of the default scene, else of the first; without scenes all nodes."""
        document = self.document
        scenes = document.table("scenes")
        if scenes:
            number = document.whole(document.tree, "", "scene", 0, 0)
            scene = document.item("scenes", number, "/scene")
            roots = document.wholes(scene, f"/scenes/{number}", "nodes")
            if len(scenes) > 1:
                others = f"{len(scenes) - 1} other scene{'s' * (len(scenes) > 2)}"
                document.warn(f"scene {number} is read; {others} left out")
        else:
            roots = self._roots
        found: dict[int, None] = {}
        waiting = list(reversed(roots))
        while waiting:
            index = waiting.pop()
            document.item("nodes", index, "/scenes")
            if index not in found:
                found[index] = None
                waiting += reversed(self._children[index])
        return list(found)

    def count(self, index: int, accessors: Accessors) -> int:
        """How often a node shows its mesh."""
        rows = self._instancing(index, accessors)
        return 1 if rows is None else len(next(iter(rows.values())))

    def instances(self, index: int, accessors: Accessors) -> Iterator[Matrix]:
        """The world matrices of a node: one, or those of its instances."""
        place, rows = f"/nodes/{index}", self._instancing(index, accessors)
        if rows is None:
            yield self.world[index]
            return
        still = {"TRANSLATION": (0.0, 0.0, 0.0), "ROTATION": (0.0, 0.0, 0.0, 1.0), "SCALE": (1.0, 1.0, 1.0)}
        count = self.count(index, accessors)
        self.copies += count if count > 1 else 0
        for k in range(count):
            t, r, s = (tuple(rows[name][k].tolist()) if name in rows else still[name] for name in still)
            yield product(self.world[index], _matrix_of(self.document, t, r, s, place))

    def _instancing(self, index: int, accessors: Accessors) -> dict[str, F64] | None:
        """The attributes of a node's instances, of one length; None where it has none."""
        place = f"/nodes/{index}"
        several = self.document.extension(self.document.item("nodes", index, place), place, INSTANCING)
        if several is None:
            return None
        inner = f"{place}/extensions/{INSTANCING}/attributes"
        attributes = self.document.get(several, inner.rpartition("/")[0], "attributes", dict)
        rows = {}
        for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3)):
            number = self.document.get(attributes, inner, name, int, None)
            if number is not None:
                rows[name] = accessors.floats(number, f"{inner}/{name}", (width,))
        if len({len(values) for values in rows.values()}) != 1:
            raise self.document.fault("its attributes are of different length, or none", inner)
        return rows

    def _local(self, index: int) -> Matrix:
        document, place = self.document, f"/nodes/{index}"
        node = document.item("nodes", index, place)
        if document.get(node, place, "matrix", list, None) is not None:
            m = document.floats(node, place, "matrix", 16, ())
            if (m[3], m[7], m[11], m[15]) != (0.0, 0.0, 0.0, 1.0):
                raise document.fault("a matrix whose last row is not 0 0 0 1", f"{place}/matrix")
            matrix = tuple(m[column * 4 + row] for row in range(3) for column in range(4))
            return _finite(document, matrix, place)
        translation = document.floats(node, place, "translation", 3, (0.0, 0.0, 0.0))
        rotation = document.floats(node, place, "rotation", 4, (0.0, 0.0, 0.0, 1.0))
        scale = document.floats(node, place, "scale", 3, (1.0, 1.0, 1.0))
        return _matrix_of(document, translation, rotation, scale, place)


def _matrix_of(
    document: Document,
    translation: tuple[float, ...],
    rotation: tuple[float, ...],
    scale: tuple[float, ...],
    place: str,
) -> Matrix:
    x, y, z, w = rotation
    length = sqrt(x * x + y * y + z * z + w * w)
    if not isfinite(length):
        raise document.fault(f"a rotation of {x:g} {y:g} {z:g} {w:g} is none", f"{place}/rotation")
    if length == 0.0:
        document.warn("a rotation of 0 0 0 0 is none; the node is not turned", f"{place}/rotation")
        w = length = 1.0
    if abs(length - 1.0) > _ROUNDED:
        document.warn(
            f"a rotation of length {length:g}, expected 1; read as if it had 1", f"{place}/rotation"
        )
    if abs(length - 1.0) > 1e-6:  # a unit one keeps its digits
        x, y, z, w = x / length, y / length, z / length, w / length
    rows = (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
    matrix: list[float] = []
    for row, offset in zip(rows, translation, strict=True):
        matrix += [value * factor for value, factor in zip(row, scale, strict=True)] + [offset]
    return _finite(document, tuple(matrix), place)


def _finite(document: Document, matrix: Matrix, place: str) -> Matrix:
    if not all(isfinite(value) for value in matrix):
        raise document.fault("a transform beyond the largest number", place)
    return matrix


def product(a: Matrix, b: Matrix) -> Matrix:
    """The transform b, then a."""
    out = []
    for row in range(0, 12, 4):
        x, y, z, t = a[row : row + 4]
        out += [x * b[column] + y * b[4 + column] + z * b[8 + column] for column in range(3)]
        out.append(x * b[3] + y * b[7] + z * b[11] + t)
    return tuple(out)


def determinant(m: Matrix) -> float:
    """The determinant of the 3 x 3 part; negative where the transform mirrors."""
    a, b, c, _, d, e, f, _, g, h, i, _ = m
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


def cofactors(m: Matrix) -> Matrix:
    """9 numbers, the transform of normals (transposed inverse times determinant)."""
    a, b, c, _, d, e, f, _, g, h, i, _ = m
    return (
        *(e * i - f * h, f * g - d * i, d * h - e * g),
        *(c * h - b * i, a * i - c * g, b * g - a * h),
        *(b * f - c * e, c * d - a * f, a * e - b * d),
    )
