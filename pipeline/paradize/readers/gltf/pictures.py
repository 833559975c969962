"""The pictures of a glTF model: files beside, data URIs, or bytes in a view."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from paradize.files import open_file
from paradize.material import MapSource, Picture, Wrap
from paradize.readers.basis import HEAD_BYTES, has_reader, is_basis
from paradize.readers.gltf.buffers import Buffers, beside, data_of
from paradize.readers.gltf.document import Document
from paradize.readers.names import named_file, spelled_otherwise, why_missing
from paradize.readers.pillow import is_avif

_WRAPS: dict[int, Wrap] = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
_LINEAR = 9729
_FILTERS = {9728: "nearest", _LINEAR: "linear"}
_SMALLER = dict.fromkeys((*_FILTERS, 9984, 9985, 9986, 9987), "trilinear")  # mips are always mixed
_MAGIC = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff")
# Pictures that only an extension allows, by the extension, and how those of them begin that are read.
SOURCES = ("EXT_texture_webp", "EXT_texture_avif", "KHR_texture_basisu", "KHR_texture_ktx")
_UNREAD = {b"\xabKTX ": "KTX2", b"DDS ": "DDS"}


W = TypeVar("W")


class Pictures:
    """absent, unread: files that textures name and that do not exist, or are of a kind that is not read."""

    def __init__(self, document: Document, buffers: Buffers) -> None:
        self.document, self.buffers = document, buffers
        self.absent: list[Path] = []
        self.unread: list[Path] = []
        self._found: dict[int, Picture | None] = {}

    def source(self, texture: int, where: str) -> MapSource | None:
        """A texture's picture and how it wraps; None, and a warning, where it cannot be used."""
        document, place = self.document, f"/textures/{texture}"
        entry = document.item("textures", texture, where)
        image = document.get(entry, place, "source", int, None)
        for name in SOURCES:
            other = document.extension(entry, place, name)
            if other is not None and image is None:
                image = document.get(other, f"{place}/extensions/{name}", "source", int)
        if image is None:
            document.warn("a texture without a picture; left out", place)
            return None
        if image not in self._found:
            self._found[image] = self._picture(image, f"{place}/source")
        picture = self._found[image]
        if picture is None:
            return None
        number = document.get(entry, place, "sampler", int, None)
        sampler = {} if number is None else document.item("samplers", number, f"{place}/sampler")
        u, v = (self._said(sampler, number, key, _WRAPS, 10497, "repeat") for key in ("wrapS", "wrapT"))
        mag = self._said(sampler, number, "magFilter", _FILTERS, _LINEAR, "linear")
        self._said(sampler, number, "minFilter", _SMALLER, _LINEAR, "trilinear")
        return MapSource(picture, wrap=(u, v), nearest=mag == "nearest")

    def _said(
        self,
        sampler: dict[str, Any],
        number: int | None,
        key: str,
        known: Mapping[int, W],
        by_itself: int,
        otherwise: W,
    ) -> W:
        """The meaning of a field of a sampler; `otherwise`, and a warning, where glTF does not know it."""
        place = f"/samplers/{number}"
        value = self.document.get(sampler, place, key, int, by_itself)
        if value not in known:
            numbers = ", ".join(map(str, known))
            what = f"{value} is none of {numbers}; taken as {otherwise}"
            self.document.warn(what, f"{place}/{key}")
        return known.get(value, otherwise)

    def _picture(self, index: int, where: str) -> Picture | None:
        document, place = self.document, f"/images/{index}"
        entry = document.item("images", index, where)
        name = str(entry.get("name") or f"image {index}")[:120]
        view = document.get(entry, place, "bufferView", int, None)
        if view is not None:
            return self._embedded(bytes(self.buffers.view(view, f"{place}/bufferView")[0]), name, place)
        uri = document.get(entry, place, "uri", str)
        data = data_of(document, uri, f"{place}/uri")
        return self._beside(uri, place) if data is None else self._embedded(data, name, place)

    def _embedded(self, data: bytes, name: str, place: str) -> Picture | None:
        webp = data[:4] == b"RIFF" and data[8:12] == b"WEBP"
        basis = is_basis(data[:HEAD_BYTES]) and has_reader()
        if not (webp or basis or is_avif(data[:HEAD_BYTES]) or data.startswith(_MAGIC)):
            self.document.warn(f"{name}: {_kind(data)} is not read; left out{_mend(_kind(data))}", place)
            return None
        return Picture(self.document.file, data, name)

    def _beside(self, uri: str, place: str) -> Picture | None:
        document, root = self.document, self.buffers.root
        path = beside(root, document.file, uri)
        if path is None and (other := spelled_otherwise(root, document.file.parent, uri)):
            path, note = other
            document.warn(note, place)
        if path is None:
            document.warn(f"picture {uri[:120]!r} is not a file inside {root}; left out", place)
            return None
        if not named_file(path, f"{place} of {document.file}"):
            self.absent.append(path)
            other = spelled_otherwise(root, document.file.parent, uri)
            if other is None:
                what = f"picture {uri[:120]!r} {why_missing(path)}; left out: put it beside the model"
                document.warn(what, place)
                return None
            path, note = other
            document.warn(note, place)
        kind = path.suffix[1:].upper()
        if kind in ("KTX2", "KTX", "BASIS") and not (_begins_as_basis(path) and has_reader()):
            self.unread.append(path)
            document.warn(f"picture {uri[:120]!r}: {kind} is not read; left out{_mend(kind)}", place)
            return None
        return Picture(path, None, path.name)


def _begins_as_basis(path: Path) -> bool:
    with open_file(path) as file:
        return is_basis(file.read(HEAD_BYTES))


def _mend(kind: str) -> str:
    """Advice for a picture in a GPU format."""
    ktx = "KTX" in kind or "BASIS" in kind
    return "; npx @gltf-transform/cli ktxdecompress IN.glb OUT.glb makes PNG of it" if ktx else ""


def _kind(data: bytes) -> str:
    found = [name for magic, name in _UNREAD.items() if data.startswith(magic)]
    return f"a {found[0]} picture" if found else "a picture that is neither PNG, JPEG, WebP nor AVIF"
