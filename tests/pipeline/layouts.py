"""UV layouts that tests share, and a scene whose one object wears them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.pipeline.scenes import make_cove, write_image

Rect = tuple[float, float, float, float]  # left, top, right, bottom in texels
SIZE = 64


def cards(islands: list[list[tuple[float, float]]], size: int = SIZE) -> str:
    """An OBJ whose triangles (of each island's corners, a fan) have these UVs, in texels of a map of `size`
    texels from its top-left corner; material `wood`."""
    lines, faces, n = ["mtllib post.mtl", "usemtl wood"], [], 0
    for k, corners in enumerate(islands):
        for x, y in corners:
            lines.append(f"v {x / size:.9f} {1 - y / size:.9f} {0.1 * k:.9f}")
            lines.append(f"vt {x / size:.9f} {1 - y / size:.9f}")
        for i in range(2, len(corners)):
            faces.append("f " + " ".join(f"{n + c}/{n + c}" for c in (1, i, i + 1)))
        n += len(corners)
    return "\n".join(lines + faces) + "\n"


def rect(left: float, top: float, right: float, bottom: float) -> list[tuple[float, float]]:
    return [(left, bottom), (right, bottom), (right, top), (left, top)]


def two_tone(gap: int, first: tuple[int, int, int], second: tuple[int, int, int]) -> tuple[str, np.ndarray]:
    """(OBJ, (64, 64, 3) uint8): two islands `gap` texels apart, in two colours; black between and around."""
    left, right = 32 - gap // 2, 32 + (gap + 1) // 2
    picture = np.zeros((SIZE, SIZE, 3), np.uint8)
    picture[4:60, 4:left] = first
    picture[4:60, right:60] = second
    return cards([rect(4, 4, left, 60), rect(right, 4, 60, 60)]), picture


def make_atlas_scene(folder: Path, obj: str, picture: np.ndarray, **settings: object) -> Path:
    """The cove with this object and this colour map, which is not a palette; settings replace `key = value`
    lines of the TOML."""
    settings.setdefault("wrap", '"clamp"')
    path = make_cove(folder)
    (folder / "post.obj").write_text(obj)
    write_image(folder / "wood.png", picture)
    text = path.read_text()
    for key, value in settings.items():
        lines = [f"{key} = {value}" if line.startswith(f"{key} = ") else line for line in text.splitlines()]
        if not any(line.startswith(f"{key} = ") for line in text.splitlines()):
            table = 'name = "cove"' if key == "viewport" else 'name = "post"'
            lines.insert(lines.index(table) + 1, f"{key} = {value}")
        text = "\n".join(lines)
    path.write_text(text)
    return path
