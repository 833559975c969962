"""The content-addressed store: what was baked once is not baked again, and damage is noticed.

blobs/<2>/<sha256>      artifact bytes, named by their hash, verified when read
products/<2>/<key>      what a task with this key produced; keys hash sources, settings and code
bakes/<id>              what a bake read and wrote, with the stamps of every file (see `Stamp`)
remotes/<id>            the products that are known to be in a shared store (see shared.py)
locks/<id>              one bake at a time on one output folder
rooms/<id>              where its workers write what is too large to be handed over; gone afterwards
locks/use               held in common by bakes, alone by `clean`

Products, bakes and remotes are sealed: a line with the SHA-256 of the rest, then JSON.
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
from typing import Any

from paradize.documents import parse_json
from paradize.errors import BakeError, FormatError
from paradize.files import open_lock, read_file, read_parts
from paradize.store.atomic import write_whole

Stamp = list[int]  # size, mtime_ns, ctime_ns, inode: a file whose stamp is the same is taken for unchanged


ENTRY_BYTES = 64 << 20  # of a product's or a bake's JSON


def stamp(path: Path | str) -> Stamp | None:
    """The stamp of a file, None where there is none."""
    try:
        status = os.stat(path)  # noqa: PTH116 (called for every file of a bake)
    except (OSError, ValueError):  # a name that no file can have
        return None
    return [status.st_size, status.st_mtime_ns, status.st_ctime_ns, status.st_ino]


def hash_file(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal. Raises BakeError when it cannot be read."""
    digest = hashlib.sha256()
    try:
        for part in read_parts(path):
            digest.update(part)
    except OSError as error:
        raise BakeError(f"cannot be read: {error.strerror or error}", file=path) from None
    return digest.hexdigest()


def key_of(*parts: object) -> str:
    """SHA-256 over a canonical JSON of the parts."""
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def default_root() -> Path:
    """$PARADIZE_STORE, else build/store under the present folder."""
    named = os.environ.get("PARADIZE_STORE")
    return Path(named) if named else Path("build/store")


def seal(tree: Any) -> bytes:
    """An entry that holds this JSON."""
    text = json.dumps(tree).encode()
    return hashlib.sha256(text).hexdigest().encode() + b"\n" + text


def unseal(data: bytes) -> Any | None:
    """The JSON that an entry holds; None where the entry is damaged."""
    digest, _, text = data.partition(b"\n")
    if hashlib.sha256(text).hexdigest().encode() != digest:
        return None
    try:
        return parse_json(text, most=ENTRY_BYTES)
    except FormatError:
        return None


def hashes_in(tree: Any) -> Iterator[str]:
    """Every value called `sha256` in a JSON tree."""
    if isinstance(tree, dict):
        if isinstance(tree.get("sha256"), str):
            yield tree["sha256"]
        for value in tree.values():
            yield from hashes_in(value)
    elif isinstance(tree, list):
        for value in tree:
            yield from hashes_in(value)


class Store:
    """A folder of baked results; every entry is written whole, so that a kill leaves nothing to mend."""

    shared_as: str | None = None  # the id of the shared store behind this one, when all is there, too

    def __init__(self, root: Path) -> None:
        self.root = root
        self.fetched: set[str] = set()  # keys of products that came from a shared store
        self.pushed: set[str] = set()  # and of those that went there

    def expect(self, keys: Iterable[str]) -> None:
        """These products will be asked for soon: a shared store begins to fetch them."""

    def settle(self) -> list[str]:
        """Waits until all is shared that is to be; returns warnings."""
        return []

    def _blob(self, sha256: str) -> Path:
        return self.root / "blobs" / sha256[:2] / sha256

    def _product(self, key: str) -> Path:
        return self.root / "products" / key[:2] / key

    def put(self, data: bytes) -> str:
        """Keeps bytes; returns their SHA-256."""
        sha256 = hashlib.sha256(data).hexdigest()
        path = self._blob(sha256)
        if Store.get(self, sha256) is None:  # here, whatever may be behind
            self._write(path, data)
        return sha256

    def get(self, sha256: str) -> bytes | None:
        """The bytes with this hash; None where the store has none or holds damaged ones, which it drops."""
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
        """Keeps the bytes of a file on the store's own file system, which is moved away; returns their
        SHA-256."""
        sha256 = hash_file(path)
        if Store.find(self, sha256) is None:
            blob = self._blob(sha256)
            try:
                blob.parent.mkdir(parents=True, exist_ok=True)
                path.replace(blob)
            except OSError as error:
                raise BakeError(f"cannot be written: {error.strerror or error}", file=blob) from None
        return sha256

    def find(self, sha256: str) -> Path | None:
        """The file that holds the bytes with this hash; None as `get`, but they are not held in memory."""
        path = self._blob(sha256)
        if not path.is_file():
            return None
        if hash_file(path) != sha256:
            path.unlink(missing_ok=True)
            return None
        return path

    def put_product(self, key: str, product: Any) -> None:
        """Remembers what the task with this key produced (JSON)."""
        self._write(self._product(key), seal(product))

    def get_product(self, key: str) -> Any | None:
        """What put_product kept; None where there is none or it cannot be read. The entry counts as used."""
        return self._read_used(self._product(key))

    def put_bake(self, name: str, record: Any) -> None:
        """Remembers what a bake read and wrote (JSON)."""
        self._write(self.root / "bakes" / name, seal(record))

    def get_bake(self, name: str) -> Any | None:
        """What put_bake kept; None where there is none or it cannot be read. The record counts as used."""
        return self._read_used(self.root / "bakes" / name)

    @staticmethod
    def _write(path: Path, data: bytes) -> None:
        """Writes an entry. A pipe or the like in its place goes: the store's folder is the store's alone."""
        write_whole(path, data, durable=False, ours=True)

    @classmethod
    def _read_used(cls, path: Path) -> Any | None:
        found = cls.read_entry(path)
        if found is not None:
            with suppress(OSError):  # a store that is only read keeps the times that it has
                os.utime(path)
        return found

    @staticmethod
    def read_entry(path: Path) -> Any | None:
        """The JSON in a sealed file; None where there is none, or a damaged one, or it cannot be read."""
        try:
            return unseal(read_file(path, ENTRY_BYTES + 65))
        except OSError:
            return None

    @contextmanager
    def room(self, name: str) -> Iterator[Path]:
        """An empty folder for the holder of the lock called `name`, removed afterwards; what a kill left in
        it is removed before."""

        path = self.root / "rooms" / name
        shutil.rmtree(path, ignore_errors=True)
        try:
            yield path
        finally:
            shutil.rmtree(path, ignore_errors=True)

    @contextmanager
    def locked(self, name: str, *, shared: bool = False) -> Iterator[None]:
        """Holds the lock called `name`; a second holder waits here, unless both hold it shared. The kernel
        frees it when a process dies."""
        path = self.root / "locks" / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            stream = open_lock(path)
        except OSError as error:
            raise BakeError(
                f"the store cannot be written: {error.strerror or error}",
                file=path,
                mend="set PARADIZE_STORE to a folder that can",
            ) from None
        with stream:
            fcntl.flock(stream, fcntl.LOCK_SH if shared else fcntl.LOCK_EX)
            yield

    def in_use(self) -> AbstractContextManager[None]:
        """While a bake uses the store: nothing is taken from it."""
        return self.locked("use", shared=True)

    def alone(self) -> AbstractContextManager[None]:
        """While entries are taken from the store: waits until no bake uses it."""
        return self.locked("use")
