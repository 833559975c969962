"""Unpacks what meshopt and Draco compressed.

Sources: KHR_meshopt_compression and KHR_draco_mesh_compression of the Khronos registry. The decoders are
those of the libraries meshoptimizer and Draco; what they may unfold is bounded before they start.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from paradize.readers.gltf.document import Document

if TYPE_CHECKING:
    import numpy.typing as npt

# A byte of a packed view stands for at most so many: runs of equal values take a quarter of a bit each.
_MOST_PER_BYTE = 512
_MOST_FACES_PER_BYTE = 256
_SMALL = 1 << 16


def unpacked_view(
    document: Document, entry: dict[str, Any], packed: memoryview, place: str
) -> tuple[memoryview, int]:
    """The bytes and the stride of a view that meshopt packed."""
    import meshoptimizer

    mode = document.get(entry, place, "mode", str)
    kind = document.get(entry, place, "filter", str, "NONE")
    stride = document.whole(entry, place, "byteStride", 1)
    count = document.whole(entry, place, "count", 1)
    if count * stride > _SMALL + _MOST_PER_BYTE * len(packed):
        what = f"{count} values of {stride} bytes from {len(packed)} packed ones"
        raise document.fault(what, place)
    document.spend(count * stride // 4, place)
    attributes = mode == "ATTRIBUTES"
    if not attributes and mode not in ("TRIANGLES", "INDICES"):
        raise document.fault(f"mode {mode[:20]!r} is not known", f"{place}/mode")
    if stride not in (2, 4) if not attributes else stride % 4 or stride > 256:
        raise document.fault(f"{stride}, not allowed for {mode}", f"{place}/byteStride")
    if mode == "TRIANGLES" and count % 3:
        raise document.fault(f"{count} indices are not whole triangles", f"{place}/count")
    filters = {
        "NONE": (None, (stride,)),
        "OCTAHEDRAL": (meshoptimizer.decode_filter_oct, (4, 8)),
        "QUATERNION": (meshoptimizer.decode_filter_quat, (8,)),
        "EXPONENTIAL": (meshoptimizer.decode_filter_exp, (stride,)),
        "COLOR": (_colors, (4, 8)),
    }
    if kind not in filters or (kind != "NONE" and not attributes):
        raise document.fault(f"filter {kind[:20]!r} is not known for {mode}", f"{place}/filter")
    unfilter, strides = filters[kind]
    if stride not in strides:
        raise document.fault(f"{stride}, not allowed for filter {kind}", f"{place}/byteStride")
    try:
        if attributes:
            values = meshoptimizer.decode_vertex_buffer(count, stride, packed)
            values = values.reshape(-1).view(np.uint8)
            values = values if unfilter is None else unfilter(values, count, stride)
        else:
            name = "decode_index_buffer" if mode == "TRIANGLES" else "decode_index_sequence"
            values = getattr(meshoptimizer, name)(count, 4, packed).astype(f"<u{stride}").view(np.uint8)
    except (RuntimeError, ValueError) as error:
        raise document.fault(f"meshopt cannot unpack it: {error}", place) from None
    return memoryview(values.tobytes()), stride


def _colors(values: npt.NDArray[np.uint8], count: int, stride: int) -> npt.NDArray[Any]:
    """RGBA of 8 or 16 bits from Y, Co, Cg and alpha. Alpha's highest bit says how many bits they have."""
    size, most = stride // 4, (1 << 2 * stride) - 1
    y, co, cg, alpha = values.view(f"<i{size}").reshape(count, 4).T.astype(np.int32)
    y, alpha = y & most, alpha & most  # without a sign
    if (alpha < 2).any():
        raise ValueError("a colour that does not say its bits")
    top = (1 << np.frexp(alpha)[1]) - 1
    alpha &= top >> 1
    colors = np.stack([y + co - cg, y + cg, y - co - cg, 2 * alpha + alpha % 2])
    return np.clip(colors * (most / top) + 0.5, 0, most).T.astype(f"<u{size}")


def draco_mesh(
    document: Document, packed: memoryview, ids: dict[str, int], indices: int, place: str
) -> tuple[npt.NDArray[np.uint32], dict[str, npt.NDArray[Any]]]:
    """Triangles (m, 3) and attributes (n, k) of a mesh that Draco packed. ids: Draco's number of each
    attribute. indices: as many as the model says."""
    try:
        import DracoPy
    except ImportError:
        mend = "pip install DracoPy, or export the model without compression"
        raise document.fault("Draco's data need the package DracoPy", place, mend) from None
    data = bytes(packed)
    most = _SMALL + 3 * _MOST_FACES_PER_BYTE * len(data)
    faces = _faces(data)
    if indices % 3 or indices > most or (faces or 0) > indices // 3:
        raise document.fault(f"{len(data)} bytes of Draco do not hold {indices // 3} triangles", place)
    if faces is not None and faces < indices // 3:
        what = f"Draco's data hold {faces} of {indices // 3} triangles: it leaves out those without an area"
        document.warn(what, place)
    document.spend(indices * 4, place)
    try:
        mesh = DracoPy.decode(data)
        triangles = np.asarray(mesh.faces, np.uint32).reshape(-1, 3)
        by_id = {attribute["unique_id"]: np.asarray(attribute["data"]) for attribute in mesh.attributes}
    except (DracoPy.FileTypeException, ValueError, RuntimeError, AttributeError, MemoryError) as error:
        raise document.fault(f"Draco cannot unpack it: {error}", place) from None
    missing = [name for name, number in ids.items() if number not in by_id]
    if missing:
        raise document.fault(f"Draco's data lack {missing[0]}", f"{place}/attributes")
    return triangles, {name: by_id[number] for name, number in ids.items()}


def _faces(data: bytes) -> int | None:
    """The number of triangles that a Draco stream announces; None for other streams than meshes of bitstream
    2.2 without metadata."""
    if len(data) < 16 or data[:9] not in (b"DRACO\2\2\1\0", b"DRACO\2\2\1\1") or data[10] & 128:
        return None
    offset = 11 if data[8] == 0 else 12  # sequential; edgebreaker names its traversal first
    numbers = []
    for _ in range(1 if data[8] == 0 else 2):
        value = shift = 0
        while offset < len(data) and shift < 35:
            byte = data[offset]
            offset += 1
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                break
        numbers.append(value)
    return numbers[-1]
