"""A remote folder by URL: read files, write them atomically, ask for sizes. fsspec implements the protocols.

Each thread opens its own connection, because some file systems of fsspec are not thread-safe. By itself sshfs
accepts any host and waits without end: here the host must be known, and every answer has a time limit.
"""

from __future__ import annotations

import errno
import hashlib
import re
import secrets
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from paradize.errors import BakeError, one_line
from paradize.files import NotARegularFileError, read_file, read_parts
from paradize.store.atomic import PARTIAL

TIMEOUT_S = 15.0  # to connect, and without any response
_URL = re.compile(r"([A-Za-z][A-Za-z0-9+.-]*)://(.+)", re.S)
_SSH = ("sftp", "ssh")
_LOCAL = ("file", "local")
_ATOMIC = ("abfs", "adl", "az", "gcs", "gs", "oci", "oss", "s3", "s3a", "tos")  # an object appears complete
_EXTRAS = {"s3": "s3fs", "s3a": "s3fs", "gs": "gcsfs", "gcs": "gcsfs", "az": "adlfs", "abfs": "adlfs"}
_MEND = "name a folder, or a URL like sftp://host/folder or s3://bucket/folder"


def shown(url: str) -> str:
    """A URL for messages: without password and query."""
    match = _URL.fullmatch(url)
    if not match:
        return one_line(url)
    host, slash, path = re.split(r"[?#]", match[2])[0].partition("/")
    user, separator, host = host.rpartition("@")
    return one_line(f"{match[1]}://{user.partition(':')[0]}{separator}{host}{slash}{path}")


def shared_id(url: str) -> str:
    """An id of a shared store that does not reveal its password."""
    return hashlib.sha256(shown(url).encode()).hexdigest()[:32]


class RemoteFolder:
    """The folder at a URL or path. Connects at its first use. Raises BakeError for an invalid URL, an unknown
    protocol, or one whose package is not installed."""

    def __init__(self, url: str) -> None:
        self.shown = shown(url)
        match = _URL.fullmatch(url)
        if not match and (not url.strip() or re.match(r"[A-Za-z0-9+._@-]{2,}:", url)):
            raise self._refused("is neither a folder nor a URL")
        self.protocol = match[1].lower() if match else "file"
        self._url = url if match else str(Path(url).absolute())
        self._secrets: list[str] = []
        self._host: dict[str, Any] = {}
        if match and self.protocol in _LOCAL and not match[2].startswith("/"):
            raise self._refused("is not an absolute path", f"write {self.protocol}:///folder")
        if match and self.protocol not in (*_LOCAL, "memory"):
            self._read_host(url)
        self._require_protocol()
        self._thread = threading.local()
        self._opening = threading.Lock()
        self._failure: Exception | None = None

    def _refused(self, what: str, mend: str = _MEND) -> BakeError:
        return BakeError(what, file=f"--store {self.shown}", mend=mend)

    def _read_host(self, url: str) -> None:
        try:
            parts = urlsplit(url)
            port = parts.port
        except ValueError:
            raise self._refused("is not a valid URL") from None
        if parts.password:
            self._secrets = [parts.password, unquote(parts.password)]
        if not parts.hostname:
            raise self._refused("names no host")
        if self.protocol in _SSH:
            if not parts.path.strip("/"):
                raise self._refused("names no folder on the host", "write sftp://host/folder")
            given = {"username": parts.username, "password": parts.password}
            self._host = {key: unquote(value) for key, value in given.items() if value}
            self._host |= {"host": parts.hostname} | ({"port": port} if port else {})
            self._url = unquote(parts.path)

    def _require_protocol(self) -> None:
        """Finds the protocol's file system."""
        import fsspec

        try:
            fsspec.get_filesystem_class("file" if self.protocol in _SSH else self.protocol)
        except ImportError as missing:
            package = _EXTRAS.get(self.protocol)
            mend = f"pip install {package}" if package else "install what it needs"
            what = f"{self.protocol}:// needs a package that is not installed: {missing}"
            raise self._refused(what, mend) from None
        except ValueError:
            raise self._refused(f"{self.protocol}:// is no known protocol") from None

    def _open(self) -> tuple[Any, str]:
        """A new file system, and the folder's path in it."""
        if self.protocol in _SSH:
            from sshfs import SSHFileSystem

            limits = {"connect_timeout": TIMEOUT_S, "login_timeout": TIMEOUT_S}
            limits |= {"keepalive_interval": TIMEOUT_S / 3.0, "keepalive_count_max": 3}
            # known_hosts=(): the user's file, as ssh does; by default sshfs accepts any host
            system = SSHFileSystem(**self._host, **limits, known_hosts=(), skip_instance_cache=True)
            return system, self._url
        from fsspec.core import url_to_fs

        options: dict[str, Any] = {"timeout": TIMEOUT_S} if self.protocol == "ftp" else {}
        if self.protocol in ("s3", "s3a"):
            limits = {"connect_timeout": TIMEOUT_S, "read_timeout": TIMEOUT_S}
            options = {"config_kwargs": limits | {"retries": {"max_attempts": 2}}}
        opened: tuple[Any, str] = url_to_fs(self._url, skip_instance_cache=True, **options)
        return opened

    def _connection(self) -> tuple[Any, str]:
        """This thread's file system and the folder's path in it. One thread connects at a time; if it fails,
        the others do not try."""
        if not hasattr(self._thread, "opened"):
            with self._opening:
                if self._failure:
                    raise self._failure
                try:
                    system, root = self._open()
                except Exception as failure:
                    self._failure = failure
                    raise
            self._thread.opened, self._thread.made = (system, root.rstrip("/")), set()
        opened: tuple[Any, str] = self._thread.opened
        return opened

    def disconnect(self) -> None:
        """Drops this thread's connection; the next call opens a new one."""
        self._thread.__dict__.clear()

    def read(self, name: str) -> bytes:
        """The bytes of a file. Raises FileNotFoundError where it is missing, and any other error of the
        protocol."""
        system, root = self._connection()
        if self.protocol in _LOCAL:
            return read_file(f"{root}/{name}")
        self._require_file(system, f"{root}/{name}")
        data: bytes = system.cat_file(f"{root}/{name}")
        return data

    def fetch(self, name: str, path: Path) -> None:
        """Copies a file to a local path. Raises as `read`."""
        system, root = self._connection()
        if self.protocol in _LOCAL:
            with path.open("wb") as copy:
                copy.writelines(read_parts(f"{root}/{name}"))
            return
        self._require_file(system, f"{root}/{name}")
        system.get_file(f"{root}/{name}", str(path))

    def _require_file(self, system: Any, path: str) -> None:
        """Raises OSError for a pipe or the like, on which an SSH server would wait for ever, and
        FileNotFoundError for a missing file."""
        if self.protocol in _SSH and system.info(path)["type"] != "file":
            raise NotARegularFileError(errno.EINVAL, "is not a regular file")

    def size(self, name: str) -> int | None:
        """Size of a file in bytes; None where it is missing. Raises any other error."""
        system, root = self._connection()
        try:
            return int(system.info(f"{root}/{name}")["size"])
        except FileNotFoundError:
            return None

    def write(self, name: str, data: bytes | Path) -> None:
        """Writes bytes or a file atomically and makes missing folders. Raises any error of the protocol."""
        system, root = self._connection()
        folder, _, base = f"{root}/{name}".rpartition("/")
        if self.protocol in _ATOMIC:
            _copy(system, data, f"{folder}/{base}")
            return
        if folder not in self._thread.made:
            _make_folder(system, folder)
            self._thread.made.add(folder)
        partial = f"{folder}/.{base}{PARTIAL}{secrets.token_hex(4)}"
        try:
            _copy(system, data, partial)
            system.mv(partial, f"{folder}/{base}")
        except BaseException:
            with suppress(Exception):  # it may not exist; the first error is the one to report
                system.rm_file(partial)
            raise

    def without_secrets(self, text: str) -> str:
        """The text on one line, without the URL's password."""
        for secret in self._secrets:
            text = text.replace(secret, "***")
        return one_line(text)


def _copy(system: Any, data: bytes | Path, path: str) -> None:
    if isinstance(data, Path):
        system.put_file(str(data), path)
    else:
        system.pipe_file(path, data)


def _make_folder(system: Any, folder: str) -> None:
    """Makes a folder. Tries twice: another process may make it at the same time."""
    try:
        system.makedirs(folder, exist_ok=True)
    except OSError:
        system.makedirs(folder, exist_ok=True)
