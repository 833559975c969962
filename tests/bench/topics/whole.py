"""The whole way: an OBJ of 80 thousand triangles with two 2048 x 2048 pictures' worth of maps, through the
command line as a person calls it, from nothing in the store.

Inside the time: starting Python, reading the OBJ and the picture, MikkTSpace frames, three levels of detail,
colour as BC1 and normals as BC5 with all mips, the gutter walk, every metric of every level, hashing and
publishing. The peer is what a person would put together of others' tools, which measure nothing: gltfpack for
frames and levels, one a call; OpenImageIO for decoding, mips in linear light and files; OpenCV for normals of
fourth order; etcpak for blocks. gltfpack from npm is WASM and compresses no textures ("node.js builds do not
support BasisU"). A second row holds the mesh alone.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import OpenImageIO as oiio

from meshes import write_torus
from peer_etcpak import BUILD, etcpak
from row import CORES, Row, on, pair_ms
from topics.normals import FOURTH, slopes

GLTFPACK = Path(__file__).parents[3] / "build/node/node_modules/gltfpack/cli.js"
SIDE = 2048
COLUMNS, ROWS = 283, 141  # 80 thousand triangles
SCENE = """
[scene]
name = "whole"
[[object]]
name = "torus"
mesh = "torus.obj"
color = "skin.png"
lods = 3
wrap = "repeat"
strength = 1.0
[[object.instance]]
[flight]
duration_s = 10.0
eye = [{ position = [9, 2, 0] }, { position = [0, 2, 9] }, { position = [-9, 2, 0] }]
target = [{ position = [0, 0, 0] }, { position = [0, 0, 0] }, { position = [0, 0, 0] }]
"""


def write_sources(folder: Path) -> int:
    """The scene, a torus with relief and one seam each way, and a picture; how many triangles there are."""
    faces = write_torus(folder / "torus.obj", COLUMNS, ROWS, lobes=20)
    y, x = np.mgrid[0:SIDE, 0:SIDE] * (2 * np.pi / SIDE)
    rng = np.random.default_rng(2)
    grain = rng.integers(-12, 13, (SIDE, SIDE))
    waves = 60 * np.sin(9 * x + 2 * np.sin(5 * y)) + 30 * np.cos(31 * y + np.sin(3 * x))
    pixels = np.clip(128 + (waves + grain)[..., None] * [1.0, 0.8, 0.55], 0, 255).astype(np.uint8)
    file = oiio.ImageOutput.create(str(folder / "skin.png"))
    spec = oiio.ImageSpec(SIDE, SIDE, 3, "uint8")
    assert file and file.open(str(folder / "skin.png"), spec) and file.write_image(pixels)
    file.close()
    (folder / "whole.toml").write_text(SCENE)
    return faces


def halved(pixels: oiio.ImageBuf) -> Iterator[oiio.ImageBuf]:
    """All mips, by a box, down to 4 texels a side: etcpak takes no less."""
    side = SIDE
    while side >= 4:
        yield pixels
        side //= 2
        pixels = oiio.ImageBufAlgo.resize(pixels, filtername="box", roi=oiio.ROI(0, side, 0, side))


def texels(pixels: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """RGBA as etcpak reads it."""
    out = np.full((*pixels.shape[:2], 4), 255, np.uint8)
    out[:, :, : pixels.shape[2]] = pixels
    return out


def blocks_of_others(folder: Path) -> None:
    """Colour as BC1 and normals as BC5, with mips, each level a file."""
    oiio.attribute("threads", CORES)
    picture = oiio.ImageBuf(str(folder / "skin.png")).copy(oiio.FLOAT)
    light = oiio.ImageBufAlgo.colorconvert(picture, "sRGB", "linear")
    for level in halved(light):
        codes = texels(oiio.ImageBufAlgo.colorconvert(level, "linear", "sRGB").get_pixels(oiio.UINT8))
        side = len(codes)
        (folder / f"color{side}.bc1").write_bytes(etcpak.compress_bc1(codes.tobytes(), side, side))
    heights = cv2.cvtColor(light.get_pixels(oiio.FLOAT), cv2.COLOR_RGB2GRAY)
    x, y, z = np.empty_like(heights), np.empty_like(heights), np.ones_like(heights)
    slopes(heights, FOURTH, (x, y))
    length = cv2.sqrt(x * x + y * y + 1.0)
    normals = cv2.merge([x / length, y / length, z / length])
    for level in halved(oiio.ImageBuf(normals)):
        vectors = level.get_pixels(oiio.FLOAT)
        vectors /= np.linalg.norm(vectors, axis=2, keepdims=True)
        codes = texels(cv2.convertScaleAbs(vectors + 1.0, alpha=127.5))
        side = len(codes)
        (folder / f"normal{side}.bc5").write_bytes(etcpak.compress_bc5(codes.tobytes(), side, side))


def rows(runs: int, folder: Path) -> Iterator[Row]:
    if not GLTFPACK.is_file():
        print("no gltfpack in build/node (make setup-test): the rows are left out\n", flush=True)
        return
    triangles = write_sources(folder)
    program = Path(sys.executable).with_name("paradize")
    result: list[str] = []

    def bake() -> None:
        done = subprocess.run(
            [program, "bake", folder / "whole.toml", "-o", folder / "out", "--force", "--json"],
            env={**os.environ, "PARADIZE_STORE": str(folder / "store"), "PARADIZE_REPORT": ""},
            capture_output=True,
            text=True,
            check=True,
        )
        result[:] = [done.stdout]

    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "check": True}

    def frames_and_levels() -> None:
        subprocess.run(
            [program, "mesh", folder / "torus.obj", "-o", folder / "a.glb", "--lods", "3"], **quiet
        )

    def gltfpack() -> None:
        for share in ("1", "0.5", "0.25"):
            command = ["node", GLTFPACK, "-i", folder / "torus.obj", "-o", folder / f"{share}.glb"]
            subprocess.run([*command, "-gt", "-si", share], **quiet)

    def others() -> None:
        gltfpack()
        blocks_of_others(folder)

    times = pair_ms(bake, others, max(1, runs // 2))
    artifacts = {entry["name"]: entry["errors"] for entry in json.loads(result[0])["artifacts"]}
    mesh = artifacts["torus_mesh"]
    sides = {"ours_on": on(CORES), "peer_on": f"gltfpack 1 thread, WASM; etcpak 1, {BUILD}; the rest {CORES}"}
    yield Row(
        f"whole: OBJ of {triangles} triangles, picture of {SIDE} -> frames, 3 LODs, BC1 and BC5 with mips",
        times[0],
        "gltfpack, OpenImageIO, OpenCV, etcpak",
        times[1],
        f"all measured: LODs rms {mesh['surface_rms']:.1e} of the diagonal, normals 99 % at most "
        f"{mesh['lod_normal_p99_deg']:.1f} deg; colour {artifacts['torus_color']['color_psnr_db']:.1f} dB",
        "nothing measured",
        1.0,
        inside="files to files; ours starts Python and measures, the peer starts node three times",
        **sides,
    )
    times = pair_ms(frames_and_levels, gltfpack, max(1, runs // 2))
    yield Row(
        f"of that: OBJ of {triangles} triangles -> frames, 3 LODs, each measured",
        times[0],
        "gltfpack, three calls, quantised",
        times[1],
        "every level's distance, normals and texture measured",
        "nothing measured",
        inside="files to files, each program from its start to its end",
        ours_on=on(CORES),
        peer_on=on(1, "WASM"),
    )
