"""The ranges of the settings that a scene, the library and the command line take alike."""

from __future__ import annotations

from typing import TypedDict

from paradize.scene.schema import FAR


class Range(TypedDict):
    """Both ends are allowed."""

    low: float
    high: float


class WholeRange(TypedDict):
    """A range of whole numbers. Both ends are allowed."""

    low: int
    high: int


LODS: WholeRange = {"low": 1, "high": 8}  # the source included
MAX_ERROR: Range = {"low": 0.0, "high": 1.0}  # of the diagonal
LOD_RATIO: Range = {"low": 0.05, "high": 0.95}
LOD_SIZE_PX: Range = {"low": 4.0, "high": 4096.0}
WELD_M: Range = {"low": 0.0, "high": FAR}
CREASE_DEG: Range = {"low": 0.0, "high": 180.0}
OCCLUSION_PX: WholeRange = {"low": 16, "high": 8192}
OCCLUSION_REACH: Range = {"low": 0.001, "high": 1.0}  # of the diagonal
STRENGTH: Range = {"low": 0.0, "high": 1000.0}  # % of the width
LEVEL: Range = {"low": -1e6, "high": 1e6}  # black, white, contrast, brightness
GAMMA: Range = {"low": 1e-3, "high": 1e6}
SIZE_M: Range = {"low": 1e-6, "high": FAR}  # of a heightmap
HEIGHT_M: Range = {"low": -FAR, "high": FAR}
HEIGHT_SCALE: Range = {"low": -1e6, "high": 1e6}
MAX_ERROR_M: Range = {"low": 0.0, "high": FAR}
ZSTD: WholeRange = {"low": 1, "high": 22}
ENCODINGS = ("grey", "terrarium", "terrain-rgb")  # of heights
TANGENTS = ("face", "vertex", "mikktspace")
