"""A store on disk that fetches from and pushes to a shared store.

The shared store has the layout of local.py's blobs and products, and nothing else. A fetched file is used
only if it matches its hash or seal. Blobs are pushed before the product that names them. Transfers run in
threads beside the bake. An unreachable or read-only shared store is a warning, not an error.
"""

from __future__ import annotations

import queue
import re
import secrets
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from paradize.files import NotARegularFileError
from paradize.store.atomic import PARTIAL
from paradize.store.local import Store, hash_file, hashes_in, seal, unseal
from paradize.store.remote_folder import RemoteFolder, shared_id

_CONNECTIONS = 4  # sshd begins to refuse connections at ten
_STALL_S = 600.0  # limit for one file
_SHA256 = re.compile(r"[0-9a-f]{64}")
_SUFFIX = re.compile(r"[a-z0-9]*")

_Transfer = tuple[Future[bool], Callable[[str], bool], str]


class SharedStore(Store):
    """A local store at `root` with the shared store at `url`, for one bake, between `in_use` and its end.

    Raises BakeError for an invalid URL, as RemoteFolder does.
    """

    def __init__(self, root: Path, url: str) -> None:
        super().__init__(root)
        self._remote = RemoteFolder(url)
        self._id = shared_id(url)
        entry = self.read_entry(root / "remotes" / self._id)
        keys = entry if isinstance(entry, list) else []
        self._known = {key for key in keys if isinstance(key, str)}  # products that the shared store has
        self._queue: queue.SimpleQueue[_Transfer | None] = queue.SimpleQueue()
        self._threads: list[threading.Thread] = []
        self._fetches: dict[str, Future[bool]] = {}  # products by key, blobs by SHA-256
        self._pushes: dict[str, Future[bool]] = {}  # products by key
        self._damaged: set[str] = set()  # names of damaged files in the shared store
        self._offline: str | None = None  # why nothing is fetched or pushed any more
        self._push_error: str | None = None  # why nothing is pushed any more

    @contextmanager
    def in_use(self) -> Iterator[None]:
        try:
            with super().in_use():
                yield
        finally:
            self._offline = "the bake is over"
            for _ in self._threads:
                self._queue.put(None)

    def expect(self, keys: Iterable[str]) -> None:
        for key in keys:
            if not self._product(key).exists():
                self._fetch(self._fetch_product, key)

    def get_product(self, key: str) -> Any | None:
        product = None if key in self._fetches else super().get_product(key)
        if product is not None and key not in self._known and key not in self._pushes:
            self._pushes[key] = self._submit(self._push_if_missing, key)
        if product is None and self._wait(self._fetch(self._fetch_product, key)):
            product = super().get_product(key)
        for sha256 in hashes_in(product):
            if not self._blob(sha256).exists():
                self._fetch(self._fetch_blob, sha256)
        return product

    def put_product(self, key: str, product: Any) -> None:
        super().put_product(key, product)
        self._fetches.pop(key, None)
        self._pushes[key] = self._submit(self._push, key)

    def get(self, sha256: str) -> bytes | None:
        self._wait_for_fetch(sha256)
        data = super().get(sha256)
        if data is None and self._wait(self._fetch(self._fetch_blob, sha256)):
            data = super().get(sha256)
        return data

    def find(self, sha256: str) -> Path | None:
        self._wait_for_fetch(sha256)
        path = super().find(sha256)
        if path is None and self._wait(self._fetch(self._fetch_blob, sha256)):
            path = super().find(sha256)
        return path

    def _wait_for_fetch(self, sha256: str) -> None:
        """Waits for a blob that is being fetched."""
        if sha256 in self._fetches:
            self._wait(self._fetches[sha256])

    def settle(self) -> list[str]:
        done = [self._wait(future) for future in self._pushes.values()]
        if all(done) and not self._offline:
            self.shared_as = self._id
        self._write(self.root / "remotes" / self._id, seal(sorted(self._known)))
        return self._warnings()

    def _warnings(self) -> list[str]:
        who, warnings = f"--store {self._remote.shown}", []
        if self._damaged:
            examples = ", ".join(sorted(self._damaged)[:3]) + (" ..." if len(self._damaged) > 3 else "")
            count = f"{len(self._damaged)} damaged file{'s' if len(self._damaged) > 1 else ''}"
            warnings.append(f"{who} holds {count}, baked anew: {examples}")
        if self._offline:
            warnings.append(f"{who} cannot be used, baked without it: {self._offline}")
        elif self._push_error:
            warnings.append(f"{who} takes nothing, so what was baked is not shared: {self._push_error}")
        return warnings

    # Transfers, which the threads run.

    def _fetch(self, call: Callable[[str], bool], name: str) -> Future[bool]:
        """Starts to fetch a product or a blob, once."""
        if name not in self._fetches:
            self._fetches[name] = self._submit(call, name)
        return self._fetches[name]

    def _submit(self, call: Callable[[str], bool], name: str) -> Future[bool]:
        if not self._threads:
            self._threads = [threading.Thread(target=self._work, daemon=True) for _ in range(_CONNECTIONS)]
            for thread in self._threads:
                thread.start()
        future: Future[bool] = Future()
        self._queue.put((future, call, name))
        return future

    def _work(self) -> None:
        while transfer := self._queue.get():
            future, call, name = transfer
            future.set_result(self._try(call, name))
        self._remote.disconnect()

    def _try(self, call: Callable[[str], bool], name: str) -> bool:
        """Runs a transfer and returns whether it succeeded. Tries twice, the second time over a new
        connection. After a second failure no transfer of this kind is tried again."""
        is_fetch = call in (self._fetch_product, self._fetch_blob)
        for second in (False, True):
            if self._offline or (self._push_error and not is_fetch):
                return False
            try:
                return call(name)
            except Exception as failure:
                if not second and not isinstance(failure, PermissionError):
                    self._remote.disconnect()
                    continue
                reason = self._remote.without_secrets(str(failure) or type(failure).__name__)
                if is_fetch:
                    self._offline = reason
                else:
                    self._push_error = reason
        return False

    def _wait(self, future: Future[bool]) -> bool:
        """Waits for a transfer and returns whether it succeeded."""
        if self._offline and not future.done():
            return False
        try:
            return future.result(timeout=_STALL_S)
        except TimeoutError:
            self._offline = f"no file arrived within {_STALL_S:g} s"
            return False

    def _fetch_product(self, key: str) -> bool:
        name = _product_name(key)
        try:
            data = self._remote.read(name)
        except FileNotFoundError:
            return False
        except NotARegularFileError:
            data = b""
        if not _is_valid(unseal(data)):
            self._damaged.add(name)
            return False
        self._write(self._product(key), data)
        self._known.add(key)
        return True

    def _fetch_blob(self, sha256: str) -> bool:
        name, path = _blob_name(sha256), self._blob(sha256)
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{sha256}{PARTIAL}{secrets.token_hex(4)}")
        try:
            self._remote.fetch(name, partial)
            if hash_file(partial) != sha256:
                self._damaged.add(name)
                return False
            partial.replace(path)
        except FileNotFoundError:
            return False
        except NotARegularFileError:
            self._damaged.add(name)
            return False
        finally:
            partial.unlink(missing_ok=True)
        self.fetched.add(sha256)
        return True

    def _push_if_missing(self, key: str) -> bool:
        """Pushes a product unless the shared store has it."""
        if self._remote.size(_product_name(key)):
            self._known.add(key)
            return True
        return self._push(key)

    def _push(self, key: str) -> bool:
        """Pushes the missing blobs, then the product."""
        product = self.read_entry(self._product(key))
        for sha256 in set(hashes_in(product)):
            name, path = _blob_name(sha256), super().find(sha256)
            if path is None:
                return False  # missing here as well: the bake makes it again and pushes it then
            if name in self._damaged or self._remote.size(name) != path.stat().st_size:
                self._remote.write(name, path)
                self.pushed.add(sha256)
        self._remote.write(_product_name(key), seal(product))
        self._known.add(key)
        return True


def _blob_name(sha256: str) -> str:
    return f"blobs/{sha256[:2]}/{sha256}"


def _product_name(key: str) -> str:
    return f"products/{key[:2]}/{key}"


def _is_valid(product: Any) -> bool:
    """Whether a fetched entry has the form of a product. Its hashes and suffixes become parts of file names,
    so they are checked."""
    if not isinstance(product, dict) or not all(map(_SHA256.fullmatch, hashes_in(product))):
        return False
    files = [record for record in product.values() if isinstance(record, dict) and "suffix" in record]
    return all(_SUFFIX.fullmatch(str(record["suffix"])) for record in files)
