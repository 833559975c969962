"""Records what a bake read, ran and wrote, and checks whether any of it has changed since.

A bake with nothing to do ends here: it parses no scene, imports no numpy, and reads no file whose stamp is
unchanged.
"""

from __future__ import annotations

import json
import os
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from pathlib import Path
from typing import Any

from paradize.artifact import FILE_NAME, REPORTED, Artifact
from paradize.documents import SCENE_FILE, JsonText, parse_json
from paradize.errors import ParadizeError
from paradize.files import resolved
from paradize.jobs.code import code_files
from paradize.jobs.libraries import library_versions
from paradize.store.atomic import is_partial
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Store, key_of, stamp


@dataclass
class BakeReport:
    """The results of a bake. fetched, pushed: artifacts that came from a shared store, and that went
    there."""

    out: Path
    artifacts: list[Artifact] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    errors: list[ParadizeError] = field(default_factory=list)
    seconds: float = 0.0
    fetched: int = 0
    pushed: int = 0
    budget: dict[str, float] = field(default_factory=dict)

    def count(self, status: str) -> int:
        """Returns how many artifacts have this status: baked, reused or failed."""
        return sum(artifact.status == status for artifact in self.artifacts)

    @property
    def told(self) -> list[Artifact]:
        """The artifacts that are told also where they are many: others did not change."""
        return [
            artifact
            for artifact in self.artifacts
            if artifact.status != "reused" or artifact.over or artifact.also
        ]

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The artifacts as `bake --json` prints them."""
        return [artifact.to_json(REPORTED) for artifact in self.artifacts]

    @property
    def texts(self) -> list[JsonText]:
        """The rows as JSON."""
        return [JsonText(json.dumps(row)) for row in self.rows]

    def as_json(self, rows: Sequence[Any] | None = None) -> dict[str, Any]:
        """The object that `bake --json` prints. rows: in place of `rows`."""
        summary: dict[str, Any] = {
            "artifacts": self.rows if rows is None else rows,
            "baked": self.count("baked"),
            "reused": self.count("reused"),
            "failed": self.count("failed"),
            "fetched": self.fetched,
            "pushed": self.pushed,
            "seconds": round(self.seconds, 3),
            "warnings": self.warnings,
        }
        if self.errors:
            summary["error"] = [str(error) for error in self.errors]
        return summary


class UnchangedReport(BakeReport):
    """The report of a bake that had nothing to do. Its artifacts are parsed where they are asked for."""

    def __init__(self, record: Mapping[str, Any], texts: Sequence[str]) -> None:
        super().__init__(
            Path(record["out"]), warnings=list(record["warnings"]), budget=dict(record["budget"])
        )
        del self.artifacts  # so that the property below is found
        self._texts, self._told = texts, [row["told"] for row in record["artifacts"]]

    def count(self, status: str) -> int:
        return len(self._texts) if status == "reused" else 0

    @cached_property
    def artifacts(self) -> list[Artifact]:  # type: ignore[override]
        return [Artifact.from_json(row) for row in self.rows]

    @property
    def told(self) -> list[Artifact]:
        return [Artifact.from_json(_row(text)) for text in compress(self._texts, self._told)]

    @property
    def rows(self) -> list[dict[str, Any]]:
        return [_row(text) for text in self._texts]

    @property
    def texts(self) -> list[JsonText]:
        return [JsonText(text) for text in self._texts]


def _row(text: str) -> dict[str, Any]:
    row: dict[str, Any] = parse_json(text.encode())
    return row


def strays(out: Path, named: Container[str]) -> list[Path]:
    """Returns files of ours in a folder that are half-written or not named by its scene.json: left by
    bakes that were killed or replaced."""
    return [
        out / name
        for name in os.listdir(out)  # noqa: PTH208 (a bake with nothing to do makes no path of each)
        if name not in named and (is_partial(name) or FILE_NAME.fullmatch(name))
    ]


def record_name(
    scene: Path, out: Path | None, tier: str | None, tiers: Mapping[str, str] | None = None
) -> str:
    """Returns the name of a bake's record. out: None if the scene's name decides. tier, tiers: as in
    BuildOptions. Another installation of Paradize has other records."""
    where = str(resolved(out)) if out else str(Path.cwd())
    return key_of(__file__, str(resolved(scene)), where, out is None, tier, dict(tiers or {}))[:32]


def unchanged_bake(store: Store, name: str, url: str | None = None) -> BakeReport | None:
    """Returns the report of the recorded bake if every file that it read, ran or wrote is unchanged, and
    all of it is in the shared store at the URL; else None."""
    record: Any
    record, texts = store.get_bake_lines(name)
    if not is_record(record) or len(record["artifacts"]) != len(texts):
        return None
    if record["libraries"] != list(library_versions()):
        return None
    if url is not None and record["shared"] != _shared_id(url):
        return None
    hash_cache = FileHashCache.from_json(record["file_hashes"])
    files = list(record["file_hashes"]["files"])
    if not files or not hash_cache.unchanged(files):
        return None
    if any(stamp(Path(path)) for path in record["absent"]):
        return None
    try:
        if strays(Path(record["out"]), {row["file"] for row in record["artifacts"]}):
            return None  # the next bake deletes them
    except OSError:
        return None
    if hash_cache.hashed:
        file_hashes = hash_cache.as_json([Path(path) for path in files])
        store.put_bake(name, record | {"file_hashes": file_hashes}, texts)
    return UnchangedReport(record, texts)


def is_record(record: Any) -> bool:
    """Whether this has the shape that `remember` writes. A valid seal does not ensure it. The lines below are
    not looked at: if no code has changed, this code wrote them."""
    try:
        files = record["file_hashes"]["files"]
        texts = [record["out"], *record["libraries"], *record["absent"], *record["warnings"], *files]
        stamps = [(*file_stamp, sha256) for file_stamp, sha256 in files.values()]
        return (
            all(type(text) is str and "\0" not in text for text in texts)
            and all(tuple(map(type, known)) == (int, int, int, int, str) for known in stamps)
            and type(record["file_hashes"]["since_ns"]) is int
            and type(record["shared"]) in (str, type(None))
            and all(type(value) in (int, float) for value in record["budget"].values())
            and all(map(_is_row, record["artifacts"]))
        )
    except (LookupError, TypeError, ValueError, AttributeError):
        return False


def _is_row(row: Any) -> bool:
    return type(row["told"]) is bool and FILE_NAME.fullmatch(row["file"]) is not None


def _shared_id(url: str) -> str:
    from paradize.store.remote_folder import shared_id  # here: a bake with nothing to share loads less

    return shared_id(url)


def remember(
    store: Store,
    name: str,
    report: BakeReport,
    inputs: Sequence[Path],
    absent: Sequence[Path],
    hash_cache: FileHashCache,
) -> None:
    """Records what a finished bake read, ran and wrote. absent: files that it looked for but that do not
    exist."""
    outputs = [report.out / SCENE_FILE, *(report.out / str(artifact.file) for artifact in report.artifacts)]
    files = list(dict.fromkeys([*inputs, *code_files("paradize.build.bake"), *outputs]))
    reused = BakeReport(report.out, [replace(row, status="reused", seconds=0.0) for row in report.artifacts])
    told = {row.name for row in reused.told}
    record = {
        "out": str(report.out),
        "libraries": list(library_versions()),
        "artifacts": [
            {"file": row.file, "sha256": row.sha256, "told": row.name in told} for row in report.artifacts
        ],
        "warnings": report.warnings,
        "budget": report.budget,
        "absent": [str(path) for path in absent],
        "shared": store.shared_as,
        "file_hashes": hash_cache.as_json(files),
    }
    store.put_bake(name, record, reused.texts)
