"""One record of a baked file, from the job that makes it to scene.json.

A worker fills in what it measured, the build adds what it decides, and each reader takes its part: the store
KEPT, `bake --json` REPORTED, scene.json PUBLISHED. A new field is a line here, in the parts that tell it,
for KEPT in PRODUCTS of `build/entries.py`, and for scene.json in `formats/scene/schema.py` and
`formats/FORMAT.md`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

FILE_NAME = re.compile(r"[a-z0-9_]+-[0-9a-f]{8}\.(glb|ktx2|ogg)")  # as Artifact.file gives it
KEPT = (
    "sha256",
    "suffix",
    "tier",
    "errors",
    "levels",
    "format",
    "reason",
    "filter",
    "warnings",
    "constant",
)
REPORTED = (
    "name", "file", "sha256", "bytes", "tier", "errors", "status", "seconds", "levels", "format", "reason",
    "filter", "tried", "over", "left_out", "coarser_left_out", "also",
)  # fmt: skip
PUBLISHED = (
    "levels", "file", "kind", "sha256", "bytes", "tier", "errors", "first_needed_s", "max_level",
    "required_detail", "gutter", "also",
)  # fmt: skip

# The change of pictures by a level of detail, as its record states: the size on the screen, then the normals,
# the silhouette and FLIP (build/measurements/lods_seen.py).
SEEN = ("seen_px", "seen_p99_deg", "seen_mean_deg", "seen_silhouette", "seen_flip")


@dataclass(frozen=True)
class Artifact:
    """A baked file.

    name: as in scene.json; before the build has named it, its product's. kind: "mesh", "texture", "cubemap"
    or "sound"; empty: it is not published. suffix: of its file. sha256, bytes: of its file; None, 0: it was
    not made.
    tier: the one that was used. errors: metric -> value, six digits; of textures those of the finest level.
    levels: what was measured of each level, the finest first. format: KTX2's, of textures. reason: why it is
    not what its tier declares. filter: the derivative filter behind it. warnings: of its job.
    status: "baked", "reused" or "failed". seconds: of its job. tried: what `auto` tried, {"requested",
    "taken", "errors"}. over: the metrics beyond their budget, as text. left_out: finer levels that no
    view asks for. coarser_left_out: coarser levels of a mesh that no view draws. first_needed_s: the
    second of the flight. max_level: the last level whose gutters are wide enough; None: any.
    required_detail: what the flight asks of it, {"left_out", "saved_bytes", "texels", "second_s", "view",
    "levels_s"}. gutter: what was measured of its gutters, as FORMAT.md says.
    also: names of equal textures that this file stands for (paradize/build/materials/shared_textures.py).
    """

    name: str
    kind: str = ""
    suffix: str = ""
    sha256: str | None = None
    bytes: int = 0
    tier: str | None = None
    errors: dict[str, float] = field(default_factory=dict)
    levels: list[dict[str, float]] = field(default_factory=list)
    format: str | None = None
    reason: str | None = None
    filter: str | None = None
    warnings: list[str] = field(default_factory=list)
    constant: list[float] | None = None
    status: str = "baked"
    seconds: float = 0.0
    tried: dict[str, Any] | None = None
    over: list[str] = field(default_factory=list)
    left_out: int = 0
    coarser_left_out: int = 0
    first_needed_s: float = 0.0
    max_level: int | None = None
    required_detail: dict[str, Any] | None = None
    gutter: dict[str, Any] | None = None
    also: list[str] = field(default_factory=list)

    @property
    def file(self) -> str | None:
        """Its name in the folder; None where it was not made."""
        return f"{self.name}-{self.sha256[:8]}.{self.suffix}" if self.sha256 else None

    def to_json(self, keys: Sequence[str]) -> dict[str, Any]:
        """The fields of one of KEPT, REPORTED, PUBLISHED."""
        return {key: getattr(self, key) for key in keys}

    @classmethod
    def from_json(cls, entry: Mapping[str, Any], **more: Any) -> Artifact:
        """The artifact of an object that to_json made; `more` sets fields. The shape is not checked."""
        known = {key: value for key, value in entry.items() if key in _FIELDS}
        if entry.get("file"):
            known["suffix"] = entry["file"].rpartition(".")[2]
        return cls(**known | more)


_FIELDS = frozenset(field.name for field in fields(Artifact))
