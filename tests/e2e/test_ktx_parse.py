"""npm ktx-parse, which shares no line with us, reads what we write and agrees."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from paradize.data import Texture
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.layout import FORMATS, full_level_count, level_bytes
from tests.sweeps import sweep

Node = Callable[[str, list[object]], Any]


SIZES = [(20, 12), (1, 1), (1, 37), (33, 7), (64, 64)]


@pytest.mark.parametrize(
    ("faces", "zstd_level"), sweep([(1, None), (1, 3), (6, None), (6, 3)], test=[(1, None), (6, 3)])
)
def test_every_format_and_size_reads_in_ktx_parse(
    tmp_path: Path, node: Node, faces: int, zstd_level: int | None
) -> None:
    written: dict[Path, Texture] = {}
    for name in FORMATS:
        for width, height in SIZES:
            if faces == 6:
                height = width
            sizes = [
                level_bytes(name, width, height, level, faces)
                for level in range(full_level_count(width, height))
            ]
            levels = tuple(bytes((31 * k + i) % 253 for i in range(size)) for k, size in enumerate(sizes))
            texture = Texture(name, width, height, levels, faces)
            path = tmp_path / f"{name}-{width}x{height}.ktx2"
            path.write_bytes(encode_ktx2(texture, zstd_level=zstd_level))
            written[path] = texture
    read = node("read_ktx2.mjs", list(written))
    assert len(read) == len(written)
    for path, texture in written.items():
        found = read[str(path)]
        fmt = FORMATS[texture.format]
        assert (found["vkFormat"], found["typeSize"]) == (fmt.vk, fmt.type_size), path
        shape = (texture.width, texture.height, texture.faces)
        assert (found["width"], found["height"], found["faces"]) == shape, path
        assert found["scheme"] == (0 if zstd_level is None else 2), path
        assert found["levels"] == [len(level) for level in texture.levels], path
        assert found["digests"] == [hashlib.sha256(level).hexdigest() for level in texture.levels], path
        described = found["descriptor"]
        assert described["colorModel"] == fmt.model, path
        assert described["transferFunction"] == fmt.transfer, path
        assert described["bytesPlane"][0] == (fmt.block_bytes if zstd_level is None else 0), path
        assert [d + 1 for d in described["texelBlockDimension"][:2]] == [fmt.block, fmt.block], path
        samples = tuple(
            (
                s["channelType"],
                s["bitOffset"],
                s["bitLength"] + 1,
                s["sampleLower"] & 0xFFFFFFFF,
                s["sampleUpper"] & 0xFFFFFFFF,
            )
            for s in described["samples"]
        )
        assert samples == fmt.samples, path
        assert found["orientation"] == "rd", path
