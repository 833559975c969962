"""The player keeps the limits of mips and parallax in scene.json, seen in its pictures."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest

from paradize.data import Mesh, Texture
from paradize.formats.ktx2.encode import encode_ktx2
from tests.player import synthetic
from tests.sweeps import sample

Edit = Callable[[dict[str, Any]], None]
SIZE = 256
MAGENTA, GREEN = (255, 0, 255, 255), (30, 160, 40, 255)


def mips(colors: list[tuple[int, int, int, int]]) -> bytes:
    """A colour map with one colour per level; the last colour fills all further levels."""
    levels = []
    for level in range(SIZE.bit_length()):
        texel = colors[min(level, len(colors) - 1)]
        levels.append(bytes(texel) * ((SIZE >> level) ** 2))
    return encode_ktx2(Texture("RGBA8_SRGB", SIZE, SIZE, tuple(levels)))


def stripes() -> bytes:
    texels = np.zeros((64, 64, 4), np.uint8)
    texels[...] = (230, 220, 60, 255)
    texels[:, ::8, :3] = texels[:, 1::8, :3] = texels[::8, :, :3] = (20, 30, 200)
    return synthetic.texture("RGBA8_SRGB", texels)


@pytest.fixture
def picture(tmp_path: Path, player: Callable[..., Any]) -> Callable[..., np.ndarray]:
    """Renders the synthetic scene: picture(files={name: bytes}, edit=...) -> (h, w, 3) float32, encoded."""
    count = 0

    def render(*, files: dict[str, bytes], edit: Edit, size: str = "96x54") -> np.ndarray:
        nonlocal count
        count += 1
        folder = synthetic.write_scene(tmp_path / str(count), bare=True)
        scene = json.loads((folder / "scene.json").read_text())
        for name, data in files.items():
            (folder / f"{name}.ktx2").write_bytes(data)
            entry = scene["artifacts"].get(name, scene["artifacts"]["box_color"])
            scene["artifacts"][name] = entry | {
                "file": f"{name}.ktx2",
                **synthetic.identity(data),
            }
        edit(scene)
        (folder / "scene.json").write_text(json.dumps(scene))
        out = folder / "a.png"
        result = player(folder, "--time", 2.5, "--size", size, "--screenshot", out, "--debug")
        assert result.returncode == 0, result.stderr
        pixels = oiio.ImageBuf(str(out)).get_pixels(oiio.FLOAT)[..., :3]
        return np.asarray(pixels, np.float32)

    return render


def squeeze(patch: pytest.MonkeyPatch, factor: float, offset: float) -> None:
    """Restricts the box's UVs to a part of its map."""
    whole = synthetic.box

    def squeezed() -> Mesh:
        mesh = whole()
        assert mesh.uvs is not None
        return replace(mesh, uvs=mesh.uvs * np.float32(factor) + np.float32(offset))

    patch.setattr(synthetic, "box", squeezed)


def ring(size: int, margin: int) -> bytes:
    """A colour map: green in its middle half and `margin` texels around, magenta beyond."""
    texels = np.full((size, size, 4), MAGENTA, np.uint8)
    green = slice(size // 4 - margin, size - size // 4 + margin)
    texels[green, green] = GREEN
    return encode_ktx2(Texture("RGBA8_SRGB", size, size, (texels.tobytes(),)))


def limit_mips(level: int | None) -> Edit:
    def edit(scene: dict[str, Any]) -> None:
        scene["artifacts"]["box_color"]["max_level"] = level

    return edit


def magenta(pixels: np.ndarray) -> int:
    red, green, blue = pixels[..., 0], pixels[..., 1], pixels[..., 2]
    return int(((red > green + 0.25) & (blue > green + 0.25)).sum())


def test_mips_coarser_than_max_level_are_never_sampled(picture: Callable[..., np.ndarray]) -> None:
    files = {"box_color": mips([GREEN, GREEN, GREEN, MAGENTA])}
    assert magenta(picture(files=files, edit=limit_mips(None))) > 50
    assert magenta(picture(files=files, edit=limit_mips(2))) == 0
    assert magenta(picture(files=files, edit=limit_mips(3))) > 50


def test_max_level_0_samples_level_0_only(picture: Callable[..., np.ndarray]) -> None:
    files = {"box_color": mips([GREEN, MAGENTA])}
    assert magenta(picture(files=files, edit=limit_mips(0))) == 0


def test_each_map_keeps_its_own_limit(picture: Callable[..., np.ndarray]) -> None:
    """The leaves have a map of their own."""
    files = {"box_color": mips([GREEN]), "leaf_color": mips([GREEN, GREEN, GREEN, MAGENTA])}

    def limits(wood: int | None, leaf: int | None) -> Edit:
        def edit(scene: dict[str, Any]) -> None:
            scene["objects"][0]["materials"]["leaf"]["maps"]["color"] = "leaf_color"
            scene["artifacts"]["box_color"]["max_level"] = wood
            scene["artifacts"]["leaf_color"]["max_level"] = leaf

        return edit

    assert magenta(picture(files=files, edit=limits(None, 2))) == 0
    assert magenta(picture(files=files, edit=limits(2, None))) > 50


def relief(scale: float, bias: float, limit: float | None) -> Edit:
    def edit(scene: dict[str, Any]) -> None:
        (box,) = scene["objects"]
        for material in box["materials"].values():
            material["maps"]["height"] = "box_height"
            material |= {"parallax_scale": scale, "parallax_bias": bias, "parallax_limit": limit}

    return edit


@pytest.mark.parametrize("bias", sample([-0.1, 0.0], every=2))
def test_parallax_keeps_its_limit(picture: Callable[..., np.ndarray], bias: float) -> None:
    height = np.zeros((64, 64, 1), np.uint8)
    height[::2] = 255
    files = {"box_color": stripes(), "box_height": synthetic.texture("R8_UNORM", height)}
    reach = 0.5 * 0.4 + abs(bias)
    share = 0.05 / reach
    free = picture(files=files, edit=relief(0.4, bias, None), size="320x180")
    held = picture(files=files, edit=relief(0.4, bias, 0.05), size="320x180")
    wanted = picture(files=files, edit=relief(0.4 * share, bias * share, None), size="320x180")
    assert np.abs(free - held).max() > 0.2
    assert np.abs(held - wanted).max() < 2.5 / 255
    assert np.abs(picture(files=files, edit=relief(0.4, bias, reach), size="320x180") - free).max() == 0.0


def test_grazing_views_move_no_sample_beyond_the_gutter(
    picture: Callable[..., np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    # The UVs cover the middle half of the map. The ring around it, as wide as the gutter, is green too. The
    # rest is magenta and must not show from any direction.
    size, reach = 64, 0.1
    files = {
        "box_color": ring(size, int(reach * size) + 2),
        "box_height": encode_ktx2(Texture("R8_UNORM", size, size, (bytes(size * size),))),
    }

    def edit(scene: dict[str, Any]) -> None:
        relief(2 * reach, 0.0, None)(scene)
        scene["flight"]["segments"] = [
            segment | {"eye": [[3.0, 0, 0, 0], [2.05, 0, 0, 0], [0.5, 0, 0, 0]]}
            for segment in scene["flight"]["segments"]
        ]

    squeeze(monkeypatch, 0.5, 0.25)
    assert magenta(picture(files=files, edit=edit, size="320x180")) == 0
    files["box_color"] = ring(size, 2)
    assert magenta(picture(files=files, edit=edit, size="320x180")) > 20


def test_maps_that_do_not_repeat_are_clamped(
    picture: Callable[..., np.ndarray], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Green except for the last column, which is next to the first only if the map repeats. The UVs start at
    # the first column and end before the last.
    texels = np.full((4, 4, 4), GREEN, np.uint8)
    texels[:, 3] = MAGENTA
    files = {"box_color": encode_ktx2(Texture("RGBA8_SRGB", 4, 4, (texels.tobytes(),)))}
    squeeze(monkeypatch, 0.5, 0.0)
    reds = []
    for repeat in (True, False):

        def edit(scene: dict[str, Any], repeat: bool = repeat) -> None:
            for material in scene["objects"][0]["materials"].values():
                material["wrap"] = ["repeat", "repeat"] if repeat else None

        pixels = picture(files=files, edit=edit, size="320x180")
        reds.append(int((pixels[..., 0] > pixels[..., 1] + 0.05).sum()))
    assert reds[0] > 100
    assert reds[1] == 0
