"""One model as the player and as three.js show it: one sun under a grey sky, one camera, no shadows."""

from __future__ import annotations

import json
import re
import resource
import subprocess
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from tests.e2e.browser import Browser, find_browser, serve
from tests.e2e.three import camera
from tests.pictures import flip_map, load
from tests.places import ROOT

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
SKY = 0.3  # linear, on all sides
SECOND = 2.5  # of the flight round the model: three quarters from the front
BAKE_S, DRAW_S = 300, 120
SAMPLES = 4  # of a pixel of ours
PARADIZE, PLAYER = ROOT / "build/venv/bin/paradize", ROOT / "build/bin/paradize-player"


@dataclass
class Baked:
    """The result of baking a model. refused: why there is nothing to draw. placement: position and scale of
    the model in the scene. cpu_s: of all commands."""

    refused: str = ""
    placement: dict[str, Any] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    cpu_s: float = 0.0


def glow(light: F64) -> F64:
    """shaders/glow.frag and post.frag, of light (h, w, 3) after exposure, up to 269 pixels high."""
    brightness = light @ [0.2126, 0.7152, 0.0722]
    spread = light * np.clip((brightness - 0.9) / np.maximum(brightness, 1e-4), 0.0, 1.0)[..., None]
    weights = np.exp(-0.07 * np.arange(-6, 7) ** 2)
    for axis in (1, 0):
        margin = [(6, 6) if k == axis else (0, 0) for k in range(3)]
        wide = np.pad(spread, margin, mode="edge")
        parts = [w * np.take(wide, range(k, k + spread.shape[axis]), axis) for k, w in enumerate(weights)]
        spread = sum(parts[1:], parts[0]) / weights.sum()
    return np.asarray(light + 0.22 * spread)


def tone_mapped(light: F32, exposure: float) -> F32:
    """shaders/post.frag: glow, shaders/lib/tonemap.glsl and sRGB, of linear radiance (h, w, 3)."""
    toe, contrast, shoulder = 0.22, 1.33, 0.532
    x = np.clip(glow(light.astype(np.float64) * exposure), 0.0, 1e4)
    low_part = toe * (np.maximum(x, 1e-6) / toe) ** contrast
    high_part = 1.0 - (1.0 - shoulder) * np.exp(-(x - shoulder) / (1.0 - shoulder))
    t = np.clip(x / toe, 0.0, 1.0)
    low = 1.0 - t * t * (3.0 - 2.0 * t)
    high = (x >= shoulder).astype(np.float64)
    mapped = np.clip(low_part * low + x * (1.0 - low - high) + high_part * high, 0.0, 1.0)
    encoded = np.where(mapped <= 0.0031308, 12.92 * mapped, 1.055 * mapped ** (1.0 / 2.4) - 0.055)
    return encoded.astype(np.float32)


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
    """The error of a command in one line."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    errors = [line for line in lines if "error" in line]
    return (errors or lines or ["nothing said"])[-1][:400]


def _cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def bake_ours(model: Path, folder: Path, built: Path) -> Baked:
    """Makes a scene of a model and bakes it with all defaults into `built`. folder: for files in between."""
    scene = folder / "scene"
    steps: list[list[object]] = [
        [PARADIZE, "new", scene, "--from", model, "--json"],
        [PARADIZE, "bake", scene / "scene.toml", "-o", built, "-j", 1, "--json"],
    ]
    baked = Baked()
    started = _cpu_s()
    environment = {
        "PARADIZE_STORE": str(folder / "store"),
        "PARADIZE_REPORT": "",
        "PATH": "/usr/bin:/bin",
        "HOME": str(folder),
    }
    for command in steps:
        words = [str(word) for word in command]
        try:
            done = subprocess.run(words, capture_output=True, text=True, timeout=BAKE_S, env=environment)
        except subprocess.TimeoutExpired:
            baked.refused = f"paradize {words[1]}: longer than {BAKE_S} s"
            break
        baked.warnings += re.findall(r"warning: (.*)", done.stderr)
        if done.returncode:
            baked.refused = last_line(done.stderr)
            break
        if words[1] == "new":
            plain_scene(scene / "scene.toml")
            said = json.loads(done.stdout)
            baked.placement = {key: said[key] for key in ("position", "scale")}
    baked.cpu_s = round(_cpu_s() - started, 2)
    return baked


def draw_ours(built: Path, picture: Path, size: int) -> tuple[F32, dict[str, Any]] | str:
    """One frame of a baked folder (h, w, 3), and its scene.json; or what the player said instead."""
    seen = ["--time", SECOND, "--size", f"{size}x{size}", "--screenshot", picture]
    command = [PLAYER, built, "--headless", "--reference", SAMPLES, *seen]
    try:
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=DRAW_S)
    except subprocess.TimeoutExpired:
        return f"paradize-player: longer than {DRAW_S} s"
    if done.returncode:
        return last_line(done.stderr)
    return load(picture), json.loads((built / "scene.json").read_text(encoding="utf-8"))


class Three:
    """three.js on the page show_model.html. A browser that no longer answers is started anew."""

    def __init__(self, program: str, profile: Path, address: str, bodies: list[bytes]) -> None:
        self.program, self.profile, self.address, self.bodies = program, profile, address, bodies
        self.browser = self._open()

    def _open(self) -> Browser:
        browser = Browser(self.program, self.profile)
        browser.open(f"{self.address}/page/show_model.html")
        return browser

    def close(self) -> None:
        self.browser.close()

    def draw(self, path: str, manifest: dict[str, Any], size: int, placement: dict[str, Any]) -> F32 | str:
        """The picture (h, w, 3) of /models/PATH; or what three.js said instead. placement: as of Baked."""
        eye, target = camera(manifest, SECOND)
        flight, sun = manifest["flight"], manifest["sun"]
        options = {
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
        self.bodies.clear()
        try:
            found = self.browser.run(f"window.show({json.dumps(path)}, {json.dumps(options)})")
        except RuntimeError as error:
            return str(error).splitlines()[0][:300]
        except (TimeoutError, EOFError) as error:
            with suppress(TimeoutError):
                self.browser.close()
            self.browser = self._open()
            return str(error)
        if found["error"] or not self.bodies:
            return f"WebGL error {found['error']}"
        light = np.frombuffer(self.bodies[0], np.float32).reshape(size, size, 4)[::-1, :, :3]
        return tone_mapped(light, manifest["exposure"])


@contextmanager
def three_of(models: Path, profile: Path) -> Iterator[Three]:
    """three.js that reads models below a folder: one browser for all of them."""
    program, three = find_browser(), ROOT / "build/node/node_modules/three"
    if program is None or not three.is_dir():
        raise SystemExit("needs a chromium that is not a snap, and `make setup-test`")
    folders = {"three": three, "page": ROOT / "tests/e2e", "models": models}
    bodies: list[bytes] = []
    with (
        serve(folders, lambda _, body: bodies.append(body)) as address,
        closing(Three(program, profile, address, bodies)) as page,
    ):
        yield page


def covered(picture: F32) -> NDArray[np.bool_]:
    """(h, w): where something is drawn before the grey sky."""
    return np.asarray(np.abs(picture - picture[0, 0]).max(axis=2) > 3.0 / 255.0)


def compare(ours: F32, theirs: F32) -> tuple[float, F32]:
    """Mean FLIP over the pixels that either picture covers (of the whole picture where none does), and FLIP
    per pixel (h, w)."""
    error = flip_map(theirs, ours)
    seen = covered(ours) | covered(theirs)
    return float(error[seen].mean()) if seen.any() else float(error.mean()), error
