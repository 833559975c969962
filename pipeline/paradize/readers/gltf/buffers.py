"""The bytes of a glTF model: its buffers, and the views of them."""

from __future__ import annotations

import base64
import binascii
from pathlib import Path
from urllib.parse import unquote, unquote_to_bytes

from paradize.errors import unread
from paradize.files import is_there, read_file
from paradize.readers.gltf.compression import unpacked_view
from paradize.readers.gltf.document import Document
from paradize.readers.names import inside, spelled_otherwise

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression", "MESHOPT_compression")


class Buffers:
    """root: the folder that files beside must lie in. libraries: those that were read; `on_library` takes
    each before it is read."""

    def __init__(self, document: Document, root: Path, on_library: list[Path] | None = None) -> None:
        self.document, self.root = document, root
        self.libraries: list[Path] = []
        self._on_library = on_library
        self._buffers: dict[int, memoryview] = {}
        self._views: dict[int, tuple[memoryview, int | None]] = {}

    def view(self, index: int, where: str) -> tuple[memoryview, int | None]:
        """The bytes of a view and its stride. Compressed views are unpacked."""
        if index not in self._views:
            self._views[index] = self._read_view(index, where)
        return self._views[index]

    def _read_view(self, index: int, where: str) -> tuple[memoryview, int | None]:
        document, place = self.document, f"/bufferViews/{index}"
        entry = document.item("bufferViews", index, where)
        for name in MESHOPT:
            packed = document.extension(entry, place, name)
            if packed is not None:
                inner = f"{place}/extensions/{name}"
                return unpacked_view(document, packed, self._range(packed, inner), inner)
        stride = document.whole(entry, place, "byteStride", 1, None)
        return self._range(entry, place), stride

    def _range(self, entry: dict[str, object], place: str) -> memoryview:
        document = self.document
        data = self.buffer(document.get(entry, place, "buffer", int), f"{place}/buffer")
        start = document.whole(entry, place, "byteOffset", 0, 0)
        length = document.whole(entry, place, "byteLength", 1)
        if start + length > len(data):
            what = f"bytes {start} to {start + length} of a buffer of {len(data)}"
            raise document.fault(what, place)
        return data[start : start + length]

    def buffer(self, index: int, where: str) -> memoryview:
        """The bytes of a buffer."""
        if index not in self._buffers:
            entry = self.document.item("buffers", index, where)
            self._buffers[index] = self._read_buffer(entry, index)
        return self._buffers[index]

    def _read_buffer(self, entry: dict[str, object], index: int) -> memoryview:
        document, place = self.document, f"/buffers/{index}"
        length = document.whole(entry, place, "byteLength", 1)
        uri = document.get(entry, place, "uri", str, None)
        if uri is not None:
            found = data_of(document, uri, f"{place}/uri")
            data = memoryview(self._beside(uri, place) if found is None else found)
        elif index == 0 and document.binary is not None:
            data = document.binary
        else:
            raise document.fault("names no bytes", place)
        if length > len(data):
            raise document.fault(f"{length} bytes are said, {len(data)} are there", f"{place}/byteLength")
        return data[:length]

    def _beside(self, uri: str, place: str) -> bytes:
        path, folder = beside(self.root, self.document.file, uri), self.document.file.parent
        # Elsewhere may lie the buffer of another model: exporters call all of them scene.bin.
        if (path is None or not _exists(path)) and (other := spelled_otherwise(folder, folder, uri)):
            path, note = other
            self.document.warn(note, place)
        if path is None:
            mend = "copy it beside the model and export again"
            raise self.document.fault(f"{uri[:120]!r} is not a file inside {self.root}", f"{place}/uri", mend)
        if self._on_library is not None:
            self._on_library.append(path)
        try:
            data = read_file(path)
        except OSError as error:
            mend = f"copy it beside {self.document.file.name}, or export the model again"
            raise unread(error, path, mend) from None
        self.libraries.append(path)
        self.document.limit += 4 * len(data)
        return data


def beside(root: Path, file: Path, uri: str) -> Path | None:
    """The file that a URI of a model names; None where it is not a path or leads out of `root`."""
    name = unquote(uri.partition("#")[0].partition("?")[0])
    if ":" in uri.partition("/")[0]:
        return None  # http: and the like
    path, plain = inside(root, file.parent, name), inside(root, file.parent, uri)
    return plain if plain is not None and not _exists(path) and _exists(plain) else path


def _exists(path: Path | None) -> bool:
    try:
        return path is not None and is_there(path)
    except OSError:
        return True  # and cannot be read: its reader says so


def data_of(document: Document, uri: str, place: str) -> bytes | None:
    """The bytes of a data URI; None for another URI."""
    if uri[:5].lower() != "data:":
        return None
    head, comma, body = uri.partition(",")
    if not comma:
        raise document.fault("a data URI without a comma", place)
    if not head.lower().endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        return base64.b64decode(body + "=" * (-len(body) % 4), validate=True)
    except (binascii.Error, ValueError):
        raise document.fault("a data URI that is not base64", place) from None
