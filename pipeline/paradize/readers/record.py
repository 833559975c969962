"""A model as a reader returns it, whatever its format."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from paradize.data import Mesh, SourcePositions
from paradize.material import Material

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

UNKNOWN_SMOOTHING = 0xFFFFFFFF
LARGEST_COORDINATE = 3.4e38  # of a file, metres: the range of float32
DEFAULT_NAME = "default"  # of a group or a material without a name


Vec3 = tuple[float, float, float]


@dataclass(frozen=True)
class Camera:
    """eye: position, metres. forward, up: unit. fov_deg: vertical; None: it is not a perspective camera.
    aspect: width over height; near_m: of its near plane; None where the file does not say."""

    name: str
    eye: Vec3
    forward: Vec3
    up: Vec3
    fov_deg: float | None
    aspect: float | None = None
    near_m: float | None = None


@dataclass(frozen=True)
class Light:
    """kind: "directional", "point", "spot". direction: unit, in which its light travels. color: linear RGB.
    intensity: lux of a directional light, else candela."""

    name: str
    kind: str
    direction: Vec3
    color: Vec3
    intensity: float


@dataclass(frozen=True)
class Views:
    """The cameras and lights beside a model, of which `new` makes a flight and a sun. notes: what is broken
    of them."""

    cameras: list[Camera]
    lights: list[Light]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Model:
    """mesh: as in the file: normals may have zero rows, which are missing; with tangents, vertices may differ
    in these alone. source: the vertex positions of the file.
    materials: by name; the groups of the mesh name them. smoothing: (m,) uint32, smoothing group of each
    triangle, 0 off, UNKNOWN_SMOOTHING where the file has none. lines: (m,) uint32, the line of each
    triangle's face; None where the file has no lines. libraries: files beside the model that were read.
    absent: files that are named but missing. unread: pictures of a kind that is not read. repairs: what the
    reader left out, as `mesh --json` has it: by name count, triangle and line of the first (None: not known).
    views: cameras and lights; None where the format has none."""

    mesh: Mesh
    source: SourcePositions
    materials: dict[str, Material]
    warnings: list[str]
    counts: dict[str, int]
    smoothing: npt.NDArray[np.uint32]
    lines: npt.NDArray[np.uint32] | None = None
    libraries: list[Path] = field(default_factory=list)
    absent: list[Path] = field(default_factory=list)
    repairs: dict[str, dict[str, int | None]] = field(default_factory=dict)
    views: Views | None = None
    unread: list[Path] = field(default_factory=list)
