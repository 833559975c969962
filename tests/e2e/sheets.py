"""Contact sheets of models: each as the player shows it, beside three.js's picture of the same file, and the
FLIP between the two.

    build/venv/bin/python -m tests.e2e.sheets FOLDER ... [-o build/sheets] [--size PX]

Both see one sun and a grey sky, through one camera, without shadows. `models.json` lists every model with its
FLIP or the reason why there is no picture; sheets show the worst first.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from paradize.formats.png import encode_png
from tests.e2e.browser import Browser, find_browser, serve
from tests.pictures import flip_map, load
from tests.places import ROOT

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
SUFFIXES = {".obj", ".gltf", ".glb"}
SKY = 0.3  # linear, on all sides
SECOND = 2.5  # of the flight round the model: three quarters from the front
BAKE_S, DRAW_S = 240, 60
PARADIZE, PLAYER = ROOT / "build/venv/bin/paradize", ROOT / "build/bin/paradize-player"
COLUMNS, ROWS = 4, 5  # of a sheet


@dataclass
class Shown:
    """A model's row in models.json. flip: mean over the pixels that either picture covers. said: why there
    is no picture of ours. three: why there is none of three.js."""

    path: str
    flip: float | None = None
    said: str = ""
    three: str = ""

    def __str__(self) -> str:
        told = [*([f"FLIP {self.flip}"] if self.flip is not None else []), self.said, self.three]
        return ", ".join(text for text in told if text)


def tone_mapped(light: F32, exposure: float) -> F32:
    """shaders/lib/tonemap.glsl and sRGB, of linear radiance (h, w, 3)."""
    toe, contrast, shoulder = 0.22, 1.33, 0.532
    x = np.clip(light.astype(np.float64) * exposure, 0.0, 1e4)
    low_part = toe * (np.maximum(x, 1e-6) / toe) ** contrast
    high_part = 1.0 - (1.0 - shoulder) * np.exp(-(x - shoulder) / (1.0 - shoulder))
    t = np.clip(x / toe, 0.0, 1.0)
    low = 1.0 - t * t * (3.0 - 2.0 * t)
    high = (x >= shoulder).astype(np.float64)
    mapped = np.clip(low_part * low + x * (1.0 - low - high) + high_part * high, 0.0, 1.0)
    encoded = np.where(mapped <= 0.0031308, 12.92 * mapped, 1.055 * mapped ** (1.0 / 2.4) - 0.055)
    return encoded.astype(np.float32)


def camera(manifest: dict[str, Any], second: float) -> tuple[F64, F64]:
    """Eye and target of the flight, from scene.json alone, as FORMAT.md tells."""
    flight = manifest["flight"]
    rows = np.array(flight["time_table"])
    k = min(int(np.searchsorted(rows[:, 0], second, side="right")) - 1, len(rows) - 2)
    (t0, u0, d0), (t1, u1, d1) = rows[k], rows[k + 1]
    x, h = (second - t0) / (t1 - t0), t1 - t0
    u = (2 * x**3 - 3 * x**2 + 1) * u0 + (x**3 - 2 * x**2 + x) * h * d0
    u += (3 * x**2 - 2 * x**3) * u1 + (x**3 - x**2) * h * d1
    at = min(int(u), len(flight["segments"]) - 1)
    powers = (u - at) ** np.arange(4)
    segment = flight["segments"][at]
    return np.array(segment["eye"]) @ powers, np.array(segment["target"]) @ powers


def plain_scene(scene: Path) -> None:
    """Leaves of a scene that `paradize new` made the model, the sun and the flight, under a grey sky."""
    text = scene.read_text(encoding="utf-8")
    head = text[: text.index("[fog]")]
    (scene.parent / "grey.exr").unlink(missing_ok=True)
    grey = oiio.ImageBuf(np.full((16, 16, 3), SKY, np.float32))
    assert grey.write(str(scene.parent / "grey.exr")), grey.geterror()
    faces = ", ".join(['"grey.exr"'] * 6)
    ambient = f"[ambient]\ncolor = [{SKY}, {SKY}, {SKY}]\nintensity = 1.0\n"
    rest = text[text.index("[[object]]") :].replace(
        "[[object]]", "[[object]]\nstrength = 0.0  # no bumps of ours"
    )
    scene.write_text(f"{head}[sky]\nfaces = [{faces}]\n\n{ambient}\n{rest}", encoding="utf-8")


def last_line(text: str) -> str:
    """What a command says at its end, in one line."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line for line in lines if "error" in line]
    return (errors or lines or ["nothing said"])[-1][:400]


def draw_ours(model: Path, folder: Path, size: int) -> tuple[F32, dict[str, Any]] | str:
    """Our picture (h, w, 3) and scene.json; or what was said instead."""
    scene, built, picture = folder / "scene", folder / "built", folder / "picture.png"
    seen = ["--time", SECOND, "--size", f"{size}x{size}", "--screenshot", picture]
    steps: list[tuple[list[object], int]] = [
        ([PARADIZE, "new", scene, "--from", model], BAKE_S),
        ([PARADIZE, "bake", scene / "scene.toml", "-o", built, "-j", 1, "--json"], BAKE_S),
        ([PLAYER, built, "--headless", "--reference", 8, *seen], DRAW_S),
    ]
    for command, limit_s in steps:
        words = [str(word) for word in command]
        environment = {"PARADIZE_STORE": str(folder / "store"), "PATH": "/usr/bin:/bin", "HOME": str(folder)}
        try:
            done = subprocess.run(words, capture_output=True, text=True, timeout=limit_s, env=environment)
        except subprocess.TimeoutExpired:
            return f"{words[0].rpartition('/')[2]} {words[1]}: longer than {limit_s} s"
        if done.returncode:
            return last_line(done.stderr)
        if words[1] == "new":
            plain_scene(scene / "scene.toml")
    return load(picture), json.loads((built / "scene.json").read_text(encoding="utf-8"))


class Three:
    """three.js on the page show_model.html."""

    def __init__(self, browser: Browser) -> None:
        self.browser = browser
        self.body = b""

    def take(self, _: dict[str, str], body: bytes) -> None:
        self.body = body

    def draw(self, path: str, manifest: dict[str, Any], placement: dict[str, Any], size: int) -> F32 | str:
        """The picture (h, w, 3) of /models/PATH; or what three.js said instead."""
        eye, target = camera(manifest, SECOND)
        flight, sun = manifest["flight"], manifest["sun"]
        asked = {
            "size": size,
            "eye": eye.tolist(),
            "target": target.tolist(),
            "fov_deg": float(np.degrees(flight["fov_rad"])),
            "near": flight["near_m"],
            "far": flight["far_m"],
            "sun": sun["direction"],
            "radiance": [sun["intensity"] * part for part in sun["color"]],
            "ambient": [SKY] * 3,
            **placement,
        }
        self.browser.complaints.clear()
        self.body = b""
        try:
            found = self.browser.run(f"window.show({json.dumps(path)}, {json.dumps(asked)})")
        except RuntimeError as error:
            return str(error).splitlines()[0][:300]
        if found["error"] or not self.body:
            return f"WebGL error {found['error']}"
        light = np.frombuffer(self.body, np.float32).reshape(size, size, 4)[::-1, :, :3]
        return tone_mapped(light, manifest["exposure"])


@contextmanager
def three_of(models: Path, profile: Path) -> Iterator[Three]:
    """three.js that reads models below a folder."""
    program, three = find_browser(), ROOT / "build/node/node_modules/three"
    if program is None or not three.is_dir():
        raise SystemExit("needs a chromium that is no snap, and `make setup-test`")
    with closing(Browser(program, profile)) as browser:
        page = Three(browser)
        folders = {"three": three, "page": ROOT / "tests/e2e", "models": models}
        with serve(folders, page.take) as address:
            browser.open(f"{address}/page/show_model.html")
            yield page


def placement_of(manifest: dict[str, Any]) -> dict[str, Any]:
    """Where the scene puts the model: position and scale of its first instance."""
    instance = manifest["objects"][0]["instances"][0]
    scale = instance["scale"]
    return {
        "position": instance["position"],
        "scale": scale if isinstance(scale, float | int) else scale[0],
    }


def covered(picture: F32) -> NDArray[np.bool_]:
    """(h, w): where something is drawn before the grey sky."""
    return np.asarray(np.abs(picture - picture[0, 0]).max(axis=2) > 3.0 / 255.0)


def compare(ours: F32, theirs: F32) -> float:
    """Mean FLIP over the pixels that either picture covers; of the whole picture where none does."""
    error = flip_map(theirs, ours)
    seen = covered(ours) | covered(theirs)
    return float(error[seen].mean()) if seen.any() else float(error.mean())


def models_below(folders: Iterable[Path]) -> list[Path]:
    """All models, in order."""
    found: set[Path] = set()
    for folder in folders:
        files = [folder] if folder.is_file() else folder.rglob("*")
        found |= {path for path in files if path.suffix.lower() in SUFFIXES and path.is_file()}
    return sorted(found)


def show_all(models: list[Path], root: Path, out: Path, size: int) -> list[Shown]:
    """Draws every model both ways, writes pairs to out/pairs, and returns the rows."""
    pairs = out / "pairs"
    shutil.rmtree(pairs, ignore_errors=True)
    pairs.mkdir(parents=True)
    rows = []
    with tempfile.TemporaryDirectory() as temporary, three_of(root, Path(temporary) / "profile") as three:
        for k, model in enumerate(models):
            row = Shown(model.relative_to(root).as_posix())
            rows.append(row)
            folder = Path(temporary) / "model"
            ours = draw_ours(model, folder, size)
            if isinstance(ours, str):
                row.said = ours
            else:
                picture, manifest = ours
                theirs = three.draw(row.path, manifest, placement_of(manifest), size)
                blank = np.full_like(picture, 0.5)
                if isinstance(theirs, str):
                    row.three = theirs
                else:
                    row.flip = round(compare(picture, theirs), 4)
                right = blank if isinstance(theirs, str) else theirs
                both = (np.clip(np.hstack([picture, right]), 0, 1) * 255.0 + 0.5).astype(np.uint8)
                (pairs / f"{k:04}.png").write_bytes(encode_png(both))
            shutil.rmtree(folder, ignore_errors=True)
            print(f"[{k + 1}/{len(models)}] {row.path}: {row}", flush=True)
    return rows


def draw_sheets(rows: list[Shown], out: Path, size: int) -> None:
    """Writes out/sheet_NN.png: pairs with their names, the worst first."""
    drawn = [k for k, row in enumerate(rows) if not row.said]
    drawn.sort(key=lambda k: -(rows[k].flip if rows[k].flip is not None else 2.0))
    side = min(size, 256)
    for old in out.glob("sheet_*.png"):
        old.unlink()
    for page, first in enumerate(range(0, len(drawn), COLUMNS * ROWS)):
        sheet = Image.new("RGB", (COLUMNS * (2 * side + 8), ROWS * (side + 24)), "white")
        text = ImageDraw.Draw(sheet)
        for place, k in enumerate(drawn[first : first + COLUMNS * ROWS]):
            x, y = place % COLUMNS * (2 * side + 8), place // COLUMNS * (side + 24)
            pair = Image.open(out / "pairs" / f"{k:04}.png").resize((2 * side, side))
            sheet.paste(pair, (x, y + 20))
            text.text((x + 2, y + 4), f"{rows[k].flip}  {rows[k].path[-70:]}", fill="black")
        sheet.save(out / f"sheet_{page:02}.png")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("-o", dest="out", type=Path, default=ROOT / "build/sheets")
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--every", type=int, default=1, help="only every Nth model")
    asked = parser.parse_args()
    folders = [folder.resolve() for folder in asked.folders]
    models = models_below(folders)[:: asked.every]
    common = Path(os.path.commonpath(folders))
    root = common if common.is_dir() else common.parent
    rows = show_all(models, root, asked.out, asked.size)
    listed = json.dumps([asdict(row) for row in rows], indent=1)
    (asked.out / "models.json").write_text(listed, encoding="utf-8")
    draw_sheets(rows, asked.out, asked.size)
    known = sorted(row.flip for row in rows if row.flip is not None)
    refused = [row for row in rows if row.said]
    middle = known[len(known) // 2] if known else float("nan")
    print(f"{len(rows)} models, {len(refused)} not drawn by us, {len(known)} compared")
    print(f"FLIP: median {middle}, worst {known[-1:]}")


if __name__ == "__main__":
    main()
