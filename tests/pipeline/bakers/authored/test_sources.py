"""Published materials through the baker of authored maps, and which way the green of published normal maps
points, guessed beside known.

`python -m tests.pipeline.bakers.authored.test_sources FOLDER` prints the tables.
"""

from __future__ import annotations

import json
import struct
import sys
from base64 import b64decode
from collections import Counter
from collections.abc import Callable, Iterator
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest

from paradize.bakers.authored.bake import bake_authored
from paradize.errors import ParadizeError
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.texels import decode_texels
from paradize.readers.image import read_image
from paradize.stages.authored import NormalCoding, decoded_normals
from paradize.stages.green import guess_green

Source = Callable[[str], Path]
SAND = "pbr-pairs/hterrain-sand/sand_"
ROCKS = "pbr-pairs/playcanvas-seaside-rocks/seaside-rocks01-"
GROUND = "pbr-pairs/terrain3d/ground037_"
# Which way green points, as the corpus's manifest measured it beside the heights.
KNOWN = {
    f"{SAND}normal.png": "down",
    "pbr-pairs/panda3d-layingrock/layingrock-n.jpg": "down",
    f"{ROCKS}normal.jpg": "down",
    f"{GROUND}nrm_rgh.png": "up",
    "textures/woodfloor043/WoodFloor043_1K_NormalGL.jpg": "up",
}
MATERIALS: dict[str, tuple[dict[str, str], dict[str, Any]]] = {
    "sand": (
        {"normal": f"{SAND}normal.png", "roughness": f"{SAND}roughness.png", "height": f"{SAND}depth.png"},
        {"green_down": True},
    ),
    "seaside rocks": (
        {
            "normal": f"{ROCKS}normal.jpg",
            "smoothness": f"{ROCKS}gloss.jpg",
            "height": f"{ROCKS}height.jpg",
            "occlusion": f"{ROCKS}ao.jpg",
        },
        {"green_down": True},
    ),
    "ground037": (
        {
            "normal": f"{GROUND}nrm_rgh.png",
            "roughness": f"{GROUND}nrm_rgh.png",
            "height": f"{GROUND}alb_ht.png",
        },
        {"channels": {"roughness": "a", "height": "a"}},
    ),
}
LEAST_DB = {"height": 40.0, "gloss": 40.0, "occlusion": 40.0}


@pytest.mark.deep
@pytest.mark.parametrize("name", MATERIALS)
def test_published_materials_are_baked_within_what_their_formats_hold(corpus: Path, name: str) -> None:
    roles, changes = MATERIALS[name]
    sources = {role: corpus / path for role, path in roles.items()}
    blocks = bake_authored(sources, wrap="repeat", **changes)
    exact = bake_authored(sources, wrap="repeat", uncompressed=True, **changes)
    assert set(blocks) == {"gloss" if role in ("roughness", "smoothness") else role for role in roles}
    for kind, made in blocks.items():
        assert not any("green" in text for text in made.warnings)
        if kind == "normal":
            assert made.errors["normal_mean_deg"] < 4 and exact[kind].errors["normal_max_deg"] < 0.02
        else:
            assert made.errors[f"{kind}_psnr_db"] > LEAST_DB[kind]
            assert min(level["psnr_db"] for level in exact[kind].levels) > 60


def test_gloss_and_roughness_of_one_published_material_agree(corpus: Path) -> None:
    """Both are JPEG: a few codes apart."""
    found = [
        bake_authored({role: corpus / f"{ROCKS}{file}.jpg"}, only=["gloss"], measure=False, uncompressed=True)
        for role, file in (("smoothness", "gloss"), ("roughness", "roughness"))
    ]
    one, other = (decode_texels(decode_ktx2(made["gloss"].data))[:, :, 1] for made in found)
    assert float(np.abs(one - other).mean()) < 0.02


# Green.


def pictures_of_gltf(path: Path) -> Iterator[bytes]:
    """The normal maps that a glTF file's materials name; nothing of a broken file."""
    raw, chunk = path.read_bytes(), b""
    try:
        if raw[:4] == b"glTF":
            (size,) = struct.unpack_from("<I", raw, 12)
            raw, chunk = raw[20 : 20 + size], raw[28 + size :]
        document = json.loads(raw)
        for material in document.get("materials", []):
            if "normalTexture" not in material:
                continue
            image = document["images"][document["textures"][material["normalTexture"]["index"]]["source"]]
            uri = image.get("uri")
            if uri is None:
                view = document["bufferViews"][image["bufferView"]]
                yield chunk[view.get("byteOffset", 0) :][: view["byteLength"]]
            elif uri.startswith("data:"):
                yield b64decode(uri.partition(",")[2])
            else:
                yield (path.parent / unquote(uri)).read_bytes()
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, OSError, struct.error):
        return


def known_maps(corpus: Path) -> Iterator[tuple[str, str, bytes]]:
    """(name, where its green points, its bytes) of normal maps; glTF's point up, as the format says."""
    seen = set()
    for name, known in KNOWN.items():
        yield name, known, (corpus / name).read_bytes()
    for path in sorted(corpus.rglob("*.gl[tb]*")):
        for data in pictures_of_gltf(path) if path.is_file() else ():
            if (digest := sha256(data).digest()) not in seen:
                seen.add(digest)
                yield str(path.relative_to(corpus)), "up", data


def guessed(data: bytes, *, flip: bool = False) -> str | None:
    """The guess for a picture; "unread" for a format that is not read."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / ("map.jpg" if data[:2] == b"\xff\xd8" else "map.png")
        path.write_bytes(data)
        try:
            values = read_image(path, color_space="data").values[:2048, :2048]
        except ParadizeError:
            return "unread"
    if values.shape[2] < 3:
        return "unread"
    return guess_green(decoded_normals(values, NormalCoding(green_down=flip)))


def confusion(corpus: Path) -> Counter[tuple[str, str | None]]:
    """(known, guessed) -> how many maps, each also with its green turned."""
    found: Counter[tuple[str, str | None]] = Counter()
    for _, known, data in known_maps(corpus):
        found[known, guessed(data)] += 1
        found["down" if known == "up" else "up", guessed(data, flip=True)] += 1
    return found


@pytest.mark.deep
def test_green_of_published_maps_is_never_guessed_wrong_and_mostly_found(corpus: Path) -> None:
    found = confusion(corpus)
    assert found["up", "down"] == found["down", "up"] == 0
    sure = found["up", "up"] + found["down", "down"]
    assert sure >= 0.6 * sum(count for (_, result), count in found.items() if result != "unread")


@pytest.mark.parametrize(("name", "wanted"), [("normal_up.png", "up"), ("normal_down.png", "down")])
def test_green_of_made_maps_is_found(source: Source, name: str, wanted: str) -> None:
    assert guessed(source(f"made/pbr-pairs/made/{name}").read_bytes()) == wanted


def main() -> None:
    """Prints each map's guess, and the table of known and guessed."""
    corpus = Path(sys.argv[1])
    for name, known, data in known_maps(corpus):
        print(f"{known:5} {guessed(data)!s:7} {name}")
    for (known, result), count in sorted(confusion(corpus).items(), key=str):
        print(f"known {known:5} guessed {result!s:7} {count}")


if __name__ == "__main__":
    main()
