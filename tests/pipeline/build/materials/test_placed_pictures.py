"""A map that lies on a material's texture coordinates in another way than its colour is drawn anew: what it
shows at any place is what the model's file says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from paradize.build.materials.model_facts import read_model_facts
from paradize.build.materials.placed_pictures import with_placed_pictures
from paradize.errors import SourceError
from paradize.formats.png import decode_png, encode_png
from paradize.material import REPEATED, MapSource, Material, Picture, Placed, Wrap
from tests.pipeline.scenes import write_image

SIDES = (24, 16)


def picture(folder: Path, values: np.ndarray) -> Path:
    write_image(folder / "m.png", values)
    return folder / "m.png"


def shown(values: np.ndarray, uv: np.ndarray, wrap: tuple[Wrap, Wrap]) -> np.ndarray:
    """The values that a sampler shows of values (h, w, c) at places (n, 2), written anew for this test."""
    found = []
    for u, v in uv:
        x, y = u * values.shape[1] - 0.5, v * values.shape[0] - 0.5
        left, top = int(np.floor(x)), int(np.floor(y))
        total = np.zeros(values.shape[2])
        for i, of_x in ((left, left + 1 - x), (left + 1, x - left)):
            for j, of_y in ((top, top + 1 - y), (top + 1, y - top)):
                at = [
                    index % size if way == "repeat" else min(max(index, 0), size - 1)
                    for index, size, way in ((j, values.shape[0], wrap[1]), (i, values.shape[1], wrap[0]))
                ]
                total += of_x * of_y * values[at[0], at[1]]
        found.append(total)
    return np.array(found)


def drawn(file: Path, placed: Placed, wrap: tuple[Wrap, Wrap] = REPEATED) -> np.ndarray:
    source = MapSource(Picture(file, name=file.name), "luminance", wrap, placed=placed)
    made = with_placed_pictures(Material("a", maps={"alpha": source})).maps["alpha"]
    assert made.placed is None and made.picture.file == file and made.picture.data is not None
    return texels(made.picture.data, file.parent).astype(np.float64)


def texels(png: bytes, folder: Path) -> np.ndarray:
    (folder / "made.png").write_bytes(png)
    return decode_png(folder / "made.png")


@pytest.mark.parametrize(
    "placed", [((3.0, 0.25), (2.0, 0.5)), ((-1.0, 0.0), (2.0, 0.25)), ((2.0, 0.0), (1.0, 0.0))]
)
def test_whole_tiles_keep_every_texel(tmp_path: Path, placed: Placed) -> None:
    values = np.random.default_rng(1).integers(0, 256, (*SIDES, 3), np.uint8)
    found = drawn(picture(tmp_path, values), placed)
    assert found.shape == (*(int(n * abs(placed[1 - k][0])) for k, n in enumerate(SIDES)), 3)
    rows, columns = found.shape[:2]
    y, x = np.mgrid[0:rows, 0:columns]
    own = [
        ((at + 0.5) / n * scale + offset)
        for at, n, (scale, offset) in ((x, columns, placed[0]), (y, rows, placed[1]))
    ]
    at = [np.floor(t * n).astype(int) % n for t, n in zip(own, SIDES[::-1], strict=True)]
    assert (found == values[at[1], at[0]]).all()


@pytest.mark.parametrize(
    ("placed", "wrap"),
    [
        (((1.0, 0.13), (1.0, 0.41)), REPEATED),
        (((0.5, 0.2), (1.7, -0.3)), REPEATED),
        (((1.6, -0.3), (1.6, -0.3)), ("clamp", "clamp")),
    ],
)
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_other_places_show_what_the_file_says(
    tmp_path: Path, placed: Placed, wrap: tuple[Wrap, Wrap], kind: type[np.generic]
) -> None:
    top = float(np.iinfo(kind).max)  # type: ignore[type-var]
    y, x = np.mgrid[0:48, 0:64] + 0.5
    waves = 0.5 + 0.45 * np.sin(2 * np.pi * x / 64)[..., None] * np.cos(2 * np.pi * y / 48)[..., None]
    values = np.rint(waves * top).astype(kind)
    found = drawn(picture(tmp_path, values), placed, wrap)
    uv = np.random.default_rng(2).uniform(0.1, 0.9, (200, 2))
    expected = shown(
        values.astype(np.float64), uv * [placed[0][0], placed[1][0]] + [placed[0][1], placed[1][1]], wrap
    )
    assert np.abs(shown(found, uv, wrap) - expected).max() < 0.02 * top  # the bend between two texels
    unmoved = shown(values.astype(np.float64), uv, wrap)
    assert np.abs(unmoved - expected).max() > 0.2 * top


def test_heights_beyond_a_png_are_refused_by_name(tmp_path: Path) -> None:
    write_image(tmp_path / "m.exr", np.full((4, 4, 1), 3.0, np.float32))
    with pytest.raises(SourceError, match=r"m\.exr: holds 3 to 3, .*; save it with 16 bits"):
        drawn(tmp_path / "m.exr", ((2.0, 0.0), (2.0, 0.0)))


def test_the_facts_of_a_model_hold_the_picture_and_the_file_that_it_is_made_of(tmp_path: Path) -> None:
    (tmp_path / "c.png").write_bytes(encode_png(np.full((8, 8, 3), 99, np.uint8)))
    holes = np.zeros((8, 8, 1), np.uint8)
    holes[:, :4] = 255
    (tmp_path / "m.png").write_bytes(encode_png(holes))
    (tmp_path / "a.mtl").write_text("newmtl wood\nmap_Kd c.png\nmap_d -s 2 2 1 m.png\n")
    faces = "vt 0 0\nvt 1 0\nvt 0 1\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl wood\nf 1/1 2/2 3/3\n"
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + faces)
    answer = read_model_facts(tmp_path / "a.obj", tmp_path, {}, {})
    facts = answer["facts"]
    assert facts.libraries == (tmp_path / "a.obj", tmp_path / "a.mtl", tmp_path / "m.png")
    assert facts.materials["wood"].alpha == "mask"
    made = texels(answer["data"]["wood", "alpha"], tmp_path)
    assert (made == np.tile(holes, (2, 2, 1))).all()
