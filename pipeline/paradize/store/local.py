"""The content-addressed store: a product that was baked once is not baked again, and damage is noticed.

blobs/<2>/<sha256>      bytes of artifacts, named by their hash, verified when read
products/<2>/<key>      result of the task with this key, a hash of sources, settings and code
bakes/<id>              files that a bake read and wrote, with their stamps (see `Stamp`)
remotes/<id>            keys that are known to be in a shared store (see shared.py)
locks/<id>              one bake at a time for each output folder
scratch/<id>            scratch folder of a bake's workers, removed at its end
locks/use               held shared by bakes, alone by `clean`

Files in products, bakes and remotes are sealed: a line with the SHA-256 of the rest, then a line of JSON.
More lines may follow, which are not parsed with it.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from stat import S_ISDIR
from typing import Any

from paradize.documents import parse_json
from paradize.errors import BakeError, FormatError, unread
from paradize.files import open_lock, read_file, read_parts
from paradize.store.atomic import unwritten, write_whole

Stamp = list[int]  # size, mtime_ns, ctime_ns, inode: equal stamps mean an unchanged file


ENTRY_BYTES = 64 << 20  # limit of an entry's JSON


def stamp(path: Path | str) -> Stamp | None:
    """The stamp of a file; None where it is missing, or a folder."""
    try:
        status = os.stat(path)  # noqa: PTH116 (called for every file of a bake)
    except (OSError, ValueError):  # a name that no file can have
        return None
    if S_ISDIR(status.st_mode):
        return None
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]


def hash_file(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal. Raises BakeError when it cannot be read."""
    digest = hashlib.sha256()
    try:
        for part in read_parts(path):
            digest.update(part)
    except OSError as error:
        raise unread(error, path, kind=BakeError) from None
    return digest.hexdigest()


def key_of(*parts: object) -> str:
    """SHA-256 over the parts as canonical JSON."""
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def default_root() -> Path:
    """$PARADIZE_STORE, else build/store under the current folder."""
    path = os.environ.get("PARADIZE_STORE")
    return Path(path) if path else Path("build/store")


def seal(tree: Any, lines: Iterable[str] = ()) -> bytes:
    """The bytes of a sealed entry: SHA-256 of the rest, the JSON, the lines."""
    text = "\n".join([json.dumps(tree), *lines]).encode()
    return hashlib.sha256(text).hexdigest().encode() + b"\n" + text


def unseal(data: bytes) -> Any | None:
    """The JSON of a sealed entry; None where it is damaged."""
    return unseal_lines(data)[0]


def unseal_lines(data: bytes) -> tuple[Any | None, list[str]]:
    """The JSON of a sealed entry and the lines below it; None and no lines where it is damaged."""
    digest, _, text = data.partition(b"\n")
    if hashlib.sha256(text).hexdigest().encode() == digest:
        first, *lines = text.split(b"\n")
        with suppress(FormatError, UnicodeDecodeError):
            return parse_json(first, limit=ENTRY_BYTES), [line.decode() for line in lines]
    return None, []


def hashes_in(tree: Any) -> Iterator[str]:
    """All values named `sha256` in a JSON tree."""
    if isinstance(tree, dict):
        if isinstance(tree.get("sha256"), str):
            yield tree["sha256"]
        for value in tree.values():
            yield from hashes_in(value)
    elif isinstance(tree, list):
        for value in tree:
            yield from hashes_in(value)


class Store:
    """A folder of baked results. Entries are written atomically, so a kill leaves nothing to repair."""

    shared_as: str | None = None  # id of the shared store, once it holds all products of this bake

    def __init__(self, root: Path) -> None:
        self.root = root
        self.fetched: set[str] = set()  # hashes of files fetched from a shared store
        self.pushed: set[str] = set()  # and of those pushed to it

    def expect(self, keys: Iterable[str]) -> None:
        """Announces products that will be needed soon, so that a shared store can fetch them."""

    def settle(self) -> list[str]:
        """Waits until everything is shared. Returns warnings."""
        return []

    def _blob(self, sha256: str) -> Path:
        return self.root / "blobs" / sha256[:2] / sha256

    def _product(self, key: str) -> Path:
        return self.root / "products" / key[:2] / key

    def put(self, data: bytes) -> str:
        """Stores bytes. Returns their SHA-256."""
        sha256 = hashlib.sha256(data).hexdigest()
        path = self._blob(sha256)
        if Store.get(self, sha256) is None:  # in this store, not in a shared one
            self._write(path, data)
        return sha256

    def get(self, sha256: str) -> bytes | None:
        """The bytes with this hash; None where they are missing or damaged. Damaged bytes are removed."""
        path = self._blob(sha256)
        try:
            data = read_file(path)
        except OSError:
            return None
        if hashlib.sha256(data).hexdigest() != sha256:
            path.unlink(missing_ok=True)
            return None
        return data

    def take(self, path: Path) -> str:
        """Stores a file by moving it; it must lie on the store's file system. Returns its SHA-256."""
        sha256 = hash_file(path)
        if Store.find(self, sha256) is None:
            blob = self._blob(sha256)
            try:
                blob.parent.mkdir(parents=True, exist_ok=True)
                path.replace(blob)
            except OSError as error:
                raise unwritten(blob, error, "name another place with PARADIZE_STORE") from None
        return sha256

    def find(self, sha256: str) -> Path | None:
        """The path of the file with this hash; None as for `get`."""
        path = self._blob(sha256)
        if not path.is_file():
            return None
        if hash_file(path) != sha256:
            path.unlink(missing_ok=True)
            return None
        return path

    def put_product(self, key: str, product: Any) -> None:
        """Stores the result (JSON) of the task with this key."""
        self._write(self._product(key), seal(product))

    def get_product(self, key: str) -> Any | None:
        """The result that put_product stored; None where it is missing or unreadable. Marks it as used."""
        return self._read_used(self._product(key))[0]

    def put_bake(self, name: str, record: Any, lines: Iterable[str] = ()) -> None:
        """Stores the record (JSON) of the files that a bake read and wrote, and lines of text."""
        self._write(self.root / "bakes" / name, seal(record, lines))

    def get_bake(self, name: str) -> Any | None:
        """The record that put_bake stored; None where it is missing or unreadable. Marks it as used."""
        return self.get_bake_lines(name)[0]

    def get_bake_lines(self, name: str) -> tuple[Any | None, list[str]]:
        """Returns a record as `get_bake` does, and the lines of text that were stored with it."""
        return self._read_used(self.root / "bakes" / name)

    @staticmethod
    def _write(path: Path, data: bytes) -> None:
        """Writes an entry. Replaces a pipe or device in its place: nobody else writes into the store's
        folder."""
        write_whole(path, data, durable=False, owned=True, option="PARADIZE_STORE")

    @classmethod
    def _read_used(cls, path: Path) -> tuple[Any | None, list[str]]:
        tree, lines = cls._read_lines(path)
        if tree is not None:
            with suppress(OSError):  # a read-only store keeps its times
                os.utime(path)
        return tree, lines

    @classmethod
    def read_entry(cls, path: Path) -> Any | None:
        """The JSON of a sealed file; None where it is missing, damaged or unreadable."""
        return cls._read_lines(path)[0]

    @staticmethod
    def _read_lines(path: Path) -> tuple[Any | None, list[str]]:
        try:
            return unseal_lines(read_file(path, ENTRY_BYTES + 65))
        except OSError:
            return None, []

    @contextmanager
    def scratch(self, name: str) -> Iterator[Path]:
        """An empty folder for the holder of the lock `name`, removed afterwards. Leftovers of a killed bake
        are removed before."""
        path = self.root / "scratch" / name
        shutil.rmtree(path, ignore_errors=True)
        try:
            yield path
        finally:
            shutil.rmtree(path, ignore_errors=True)

    @contextmanager
    def locked(self, name: str, *, shared: bool = False) -> Iterator[None]:
        """Holds the lock `name`. A second holder waits, unless both hold it shared. The kernel frees it when
        the process ends."""
        path = self.root / "locks" / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            lock_file = open_lock(path)
        except OSError as error:
            raise BakeError(
                f"the store cannot be written: {error.strerror or error}",
                file=path,
                mend="set PARADIZE_STORE to a folder that can",
            ) from None
        with lock_file:
            fcntl.flock(lock_file, fcntl.LOCK_SH if shared else fcntl.LOCK_EX)
            yield

    def in_use(self) -> AbstractContextManager[None]:
        """Lock for a bake: nothing is removed from the store meanwhile."""
        return self.locked("use", shared=True)

    def alone(self) -> AbstractContextManager[None]:
        """Lock for removing entries: waits until no bake uses the store."""
        return self.locked("use")
