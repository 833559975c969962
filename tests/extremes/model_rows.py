"""Rows of the other doors of models, and of instances: glTF, STL and tables of instances, held to numbers of
more bits."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from paradize.data import Mesh
from paradize.errors import ParadizeError, SceneError, SourceError
from paradize.placement import to_world, turned_back
from paradize.readers.model import read_model
from paradize.readers.record import Model
from paradize.scene.placement import placed
from paradize.scene.settings.instance_table import read_instances
from tests.extremes.shapes import MESHES, ball, mirrored
from tests.extremes.table import Row
from tests.pipeline.readers.gltf.made import Made, shown

Wide = np.ndarray[Any, np.dtype[np.longdouble]]
POINTS = np.random.default_rng(3).uniform(-1.0, 1.0, (24, 3))


@dataclass(frozen=True)
class Placed:
    """A mesh below a node of glTF."""

    mesh: Mesh
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def corners(self) -> Wide:
        """(m, 3, 3): where the triangles' corners are, seen from outside."""
        places = self.mesh.positions.astype(np.longdouble) * self.scale + self.at
        found = places[self.mesh.triangles]
        return found[:, ::-1] if np.prod(self.scale) < 0 else found


_NODES: dict[str, Callable[[], Placed]] = {
    "tiny": lambda: Placed(ball(), (1e-30, 1e-30, 1e-30)),
    "huge": lambda: Placed(ball(), (1e30, 1e30, 1e30)),
    "far": lambda: Placed(ball(), at=(1e6, -1e6, 1e6)),
    "mirrored": lambda: Placed(mirrored(ball()), (1.0, -2.0, 0.5)),
    "sliver": lambda: Placed(ball(), (1.0, 1.0, 1e-6)),
}
INPUTS = {
    name: _NODES.get(name, lambda name=name: Placed(replace(MESHES[name](), origin=(0.0, 0.0, 0.0))))  # type: ignore[misc]
    for name in MESHES
    if name != "denormal"
}


def _read(write: Callable[[Path], object], name: str) -> Model:
    """As a bake reads it; messages name no folder, which is another each time."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        write(path)
        try:
            return replace(read_model(path), warnings=[])
        except SourceError as error:
            raise SourceError(error.what, place=error.place, mend=error.mend) from None


def _read_gltf(given: Placed) -> Model:
    made, mesh = Made(), given.mesh
    if not len(mesh.positions):
        made.show(made.add("nodes"))
        return _read(made.glb, "a.glb")
    attributes = {
        "POSITION": made.array(mesh.positions),
        "NORMAL": made.array(mesh.normals),
        "TEXCOORD_0": made.array(mesh.uvs),
    }
    primitive = {"attributes": attributes, "indices": made.array(mesh.triangles.reshape(-1))}
    document = shown(primitive, made, scale=given.scale, translation=given.at)
    return _read(document.glb, "a.glb")


def _binary_stl(given: Placed) -> bytes:
    """float32: what is beyond it is written as the nearest there is."""
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets = np.zeros(len(given.mesh.triangles), kind)
    with np.errstate(invalid="ignore"):
        facets["corners"] = given.corners
    return bytes(80) + len(facets).to_bytes(4, "little") + facets.tobytes()


def _read_binary(given: Placed) -> Model:
    return _read(lambda path: path.write_bytes(_binary_stl(given)), "a.stl")


def _read_text(given: Placed) -> Model:
    lines = ["solid a"]
    for facet in given.corners.astype(np.float64).tolist():
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(map(repr, corner)) for corner in facet]
        lines += ["endloop", "endfacet"]
    text = "\n".join([*lines, "endsolid a", ""])
    return _read(lambda path: path.write_text(text), "a.stl")


def _share_off(wanted: Wide, made: Model) -> float:
    """The farthest corner from its place, in diagonals; any corner of a triangle may be its first."""
    origin = np.array(made.mesh.origin, np.longdouble)
    found = (made.mesh.positions.astype(np.longdouble) + origin)[made.mesh.triangles]
    scale = np.abs(wanted).max() or np.longdouble(1)
    turns = [np.roll(found, k, axis=1) - wanted for k in range(3)]
    off = np.min([np.sqrt(((turn / scale) ** 2).sum(axis=2)).max(axis=1) for turn in turns], axis=0).max()
    places = wanted.reshape(-1, 3) / scale
    diagonal = np.sqrt(((places.max(axis=0) - places.min(axis=0)) ** 2).sum())
    return float(off / diagonal) if diagonal else float(off)


def _gltf_error(given: Placed, made: Model) -> float:
    return _share_off(given.corners, made)


def _binary_error(given: Placed, made: Model) -> float:
    return _share_off(given.corners.astype(np.float32).astype(np.longdouble), made)


Table = list[tuple[float, ...]]  # x, y, z, yaw, pitch, roll in degrees, three scales


def _tables() -> dict[str, Callable[[], Table]]:
    def rows(
        count: int, *, at: float = 10.0, turn: float = 360.0, scales: tuple[float, ...] = (1, 1, 1)
    ) -> Table:
        rng = np.random.default_rng(count)
        places, angles = rng.uniform(-at, at, (count, 3)), rng.uniform(-turn, turn, (count, 3))
        sizes = np.array(scales) * rng.uniform(0.5, 1.0, (count, 1))
        return [tuple(row) for row in np.hstack([places, angles, sizes]).tolist()]

    def quarters() -> Table:
        steps = (-3600.0, -270.0, -180.0, -90.0, 0.0, 90.0, 180.0, 450.0)
        return [(0, 0, 0, a, b, c, 1, 1, 1) for a in steps for b in steps for c in steps]

    return {
        "zero": lambda: [],
        "one": lambda: rows(1),
        "many": lambda: rows(3000),
        "constant": lambda: rows(1) * 100,
        "tiny": lambda: rows(50, scales=(1e-5, 1e-5, 1e-5)),
        "huge": lambda: rows(50, scales=(1e6, 1e6, 1e6)),
        "far": lambda: rows(50, at=1e6),
        "denormal": lambda: rows(50, at=1e-310),
        "nan": lambda: [(0, float("nan"), 0, 0, 0, 0, 1, 1, 1)],
        "inf": lambda: [(0, 0, 0, float("inf"), 0, 0, 1, 1, 1)],
        "parallel": lambda: rows(50, turn=0.0),
        "opposite": quarters,
        "degenerate": lambda: [(1, 2, 3, yaw, 90.0, -yaw, 1, 1, 1) for yaw in range(-180, 180, 15)],
        "mirrored": lambda: rows(50, scales=(-1, 1, 1)) + rows(50, scales=(-1, -2, -3)),
        "sliver": lambda: rows(50, scales=(1e-5, 1, 1e6)),
        "largest": lambda: rows(57_000),
    }


def _stand(rows: Table) -> list[list[Any]]:
    """Where the points are in the world, and back from there turned as they were, by instance."""
    text = "\n".join(
        [
            "x,y,z,yaw_deg,pitch_deg,roll_deg,scale_x,scale_y,scale_z",
            *(",".join(map(repr, row)) for row in rows),
        ]
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.csv"
        path.write_text(text + "\n")
        try:
            instances = [placed(one) for one in read_instances(path)]
        except SceneError as error:
            raise ParadizeError(error.what, place=error.place, mend=error.mend) from None
    made = []
    for one in instances:
        there = np.stack(to_world(POINTS.T, one), axis=-1)
        x, y, z = (POINTS * one["scale"]).T
        back = turned_back(tuple((there - one["position"]).T), one["rotation"])  # type: ignore[arg-type]
        made.append([there, np.stack(back, axis=-1) - np.stack([x, y, z], axis=-1)])
    return made


def _stand_error(rows: Table, made: list[list[Any]]) -> float:
    """Of the size of the place and the points; against matrices in numbers of more bits."""
    worst = 0.0
    for row, (there, left) in zip(rows, made, strict=True):
        wide = np.array(row, np.longdouble)
        position, scale = wide[:3], wide[6:]
        yaw, pitch, roll = (np.deg2rad(angle) for angle in np.remainder(wide[3:6], np.longdouble(360)))
        turn = _about(1, yaw) @ _about(0, pitch) @ _about(2, roll)
        wanted = (POINTS.astype(np.longdouble) * scale) @ turn.T + position
        size = max(np.abs(position).max(), np.abs(scale).max())
        worst = max(worst, float(np.abs(there - wanted).max() / size), float(np.abs(left).max() / size))
    return worst


def _about(axis: int, angle: Any) -> Any:
    """The matrix of a turn about X, Y or Z."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3, dtype=np.longdouble)
    matrix[[i, i, j, j], [i, j, i, j]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
    return matrix


_STEPS = {"denormal": "float32 has steps of 1e-45 there: metrics.loading tells what they cost"}
_NO_PLACE = {"nan": "lies at nan nan nan", "inf": "lies at nan inf nan"}
_NO_CORNER = {"zero": "holds no facets", "nan": "a corner at 0 nan 0", "inf": "a corner at 0 inf 0"}
ROWS = [
    Row(
        "readers.gltf",
        INPUTS,
        _read_gltf,
        _gltf_error,
        "diagonals",
        1e-6,
        refused={"zero": "shows no triangles", **_NO_PLACE},
        absent=_STEPS,
    ),
    Row(
        "readers.stl",
        INPUTS,
        _read_binary,
        _binary_error,
        "diagonals",
        1e-6,
        part="binary",
        refused=_NO_CORNER,
        absent=_STEPS,
    ),
    Row(
        "readers.stl",
        INPUTS,
        _read_text,
        _gltf_error,
        "diagonals",
        1e-6,
        part="text",
        refused=_NO_CORNER,
        absent=_STEPS,
    ),
    Row(
        "placement",
        _tables(),
        _stand,
        _stand_error,
        "of its size",
        1e-14,
        refused={"zero": "there are none", "nan": "is nan", "inf": "is inf, out of range"},
    ),
]
