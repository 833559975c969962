"""Keeps artifacts' bytes in the store rather than in memory: a bake of ten thousand artifacts holds one at
a time."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

from paradize.errors import BakeError, unread
from paradize.files import read_file
from paradize.store.local import Store


def keep_artifact(store: Store, data: bytes | Path) -> tuple[str, Path]:
    """Stores bytes, or a file on the store's own file system, which is moved. Returns SHA-256 and path."""
    sha256 = store.put(data) if isinstance(data, bytes) else store.take(data)
    kept = store.find(sha256)
    if kept is None:
        raise BakeError("was changed as it was written", file=store.root)
    return sha256, kept


def read_artifact(path: Path) -> bytes:
    """Returns the bytes of a file in the store. Raises BakeError."""
    try:
        return read_file(path)
    except OSError as error:
        raise unread(error, path, "bake again", BakeError) from None


class Artifacts(Mapping[str, bytes | Path]):
    """Artifacts' bytes by name, read on access; for large ones the file's path.

    files: path by name. large: names of those that may not fit into memory.
    """

    def __init__(self, files: Mapping[str, Path], large: Collection[str]) -> None:
        self.files, self.large = files, large

    def __getitem__(self, name: str) -> bytes | Path:
        path = self.files[name]
        return path if name in self.large else read_artifact(path)

    def __iter__(self) -> Iterator[str]:
        return iter(self.files)

    def __len__(self) -> int:
        return len(self.files)

    def __contains__(self, name: object) -> bool:
        return name in self.files
