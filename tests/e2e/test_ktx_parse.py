"""npm ktx-parse, which shares no line with us, reads what we write and agrees."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from paradize.data import Texture
from paradize.formats.ktx2 import FORMATS, encode_ktx2, full_level_count, level_bytes

Node = Callable[[str, list[object]], Any]


@pytest.mark.parametrize("faces", [1, 6])
def test_every_format_reads_in_ktx_parse(tmp_path: Path, node: Node, faces: int) -> None:
    width, height = (16, 16) if faces == 6 else (20, 12)
    files: list[object] = []
    for name in FORMATS:
        count = full_level_count(width, height)
        levels = tuple(bytes(level_bytes(name, width, height, level, faces)) for level in range(count))
        path = tmp_path / f"{name}.ktx2"
        path.write_bytes(encode_ktx2(Texture(name, width, height, levels, faces)))
        files.append(path)
    read = node("read_ktx2.mjs", files)
    for name, path in zip(FORMATS, files, strict=True):
        found = read[str(path)]
        assert found["vkFormat"] == FORMATS[name].vk
        assert (found["width"], found["height"], found["faces"]) == (width, height, faces)
        assert found["levels"] == [
            level_bytes(name, width, height, level, faces) for level in range(len(found["levels"]))
        ]
        assert len(found["levels"]) == full_level_count(width, height)
