"""Contact sheets of models: each as the player shows it, beside three.js's picture of the same file, and the
FLIP between the two.

    build/venv/bin/python -m tests.e2e.sheets FOLDER ... [-o build/sheets] [--size PX] [--redo FLIP]

`results.json` lists every model with its FLIP or the reason why there is no picture; `index.html` and
`sheet_NN.png` show the worst first: ours, three.js's, and FLIP per pixel. Models that use what the player or
three.js leaves out on purpose (a clear coat, points ...) follow in `lacking_NN.png`. A run that was ended
goes on where it stood: what has a result is not drawn again. After a change of shaders, --redraw draws all
models again from what is baked (`baked/`); after one of the pipeline, --redo bakes again what looked wrong.
"""

from __future__ import annotations

import argparse
import html
import json
import os
import re
import shutil
import statistics
import tempfile
from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from paradize.formats.png import encode_png
from tests.e2e.model_pictures import Three, bake_ours, compare, draw_ours, three_of
from tests.places import ROOT

SUFFIXES = {".obj", ".gltf", ".glb"}
COLUMNS, ROWS = 3, 5  # of a sheet
# Differences that the pipeline warns of and the picture shows. Animations, skins and morphs are at rest in
# both pictures.
LACKED = re.compile(
    r"KHR_materials_(?:anisotropy|clearcoat|diffuse_transmission|dispersion|iridescence|sheen|transmission|volume)\b"
    r"|KHR_texture_ktx\b"
    r"|(?:points|lines)(?= are not read)|(?:point|line) elements"
    r"|KHR_materials_pbrSpecularGlossiness"  # three.js
)


@dataclass
class Shown:
    """A model's row in results.json. key: of its pictures. flip: mean over the pixels that either picture
    covers. refused: why there is no picture of ours. three: why there is none of three.js. lacks: what the
    player or three.js leaves out on purpose. placement: as of Baked. cpu_s: of making the scene and baking
    it."""

    path: str
    key: str
    flip: float | None = None
    refused: str = ""
    three: str = ""
    lacks: list[str] = field(default_factory=list)
    placement: dict[str, Any] = field(default_factory=dict)
    cpu_s: float = 0.0

    @property
    def empty(self) -> bool:
        """Whether the file has no surface that could be drawn: only points, lines, lights ..."""
        return "shows no triangles" in self.refused or "no faces" in self.refused

    def __str__(self) -> str:
        flip = [] if self.flip is None else [f"FLIP {self.flip}"]
        parts = [*flip, self.refused, self.three, *self.lacks, f"{self.cpu_s} s"]
        return ", ".join(part for part in parts if part)


def models_below(folders: Iterable[Path], without: Iterable[str] = ()) -> list[Path]:
    """All models: folder by folder, sorted in each. Folders named in `without` are left out."""
    found: dict[Path, None] = {}
    left_out = set(without)
    for folder in folders:
        for path in [folder] if folder.is_file() else sorted(folder.rglob("*")):
            if path.suffix.lower() in SUFFIXES and path.is_file() and left_out.isdisjoint(path.parts):
                found[path] = None
    return list(found)


def without_model(manifest: str) -> dict[str, str]:
    """The files of a corpus that hold no valid model by its MANIFEST.md, and why: those that its
    scan, which is not ours, found to have no face (f=0, 0 tris), no face with an area, numbers that are none,
    or indices of nothing. manifest: rows of a table, the path first, the scan's words last."""
    found = {}
    for line in manifest.splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        path, scan = cells[0], cells[-1]
        if Path(path).suffix.lower() not in SUFFIXES:
            continue
        faces = re.search(r"\bf=(\d+)|\b(\d+) tris\b", scan)
        count = None if faces is None else int(faces[1] or faces[2])
        flat = re.search(r"degenerate faces\((\d+)\)", scan)
        if count == 0:
            found[path] = "no face"
        elif flat and int(flat[1]) == count:
            found[path] = "no face with an area"
        elif broken := re.search(r"NaN/Inf/short/garbage numbers|out-of-range/zero index", scan):
            found[path] = broken[0]
    return found


def key_of(model: Path) -> str:
    """Of a model by its bytes and where it lies: files of one text may have other pictures beside them."""
    return sha256(f"{model.parent.name}/{model.name}\n".encode() + model.read_bytes()).hexdigest()[:16]


def show(model: Path, row: Shown, three: Three, out: Path, size: int, *, rebake: bool) -> None:
    """Draws a model both ways into out/pairs: ours, three.js's, FLIP. Fills its row."""
    built = out / "baked" / row.key
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        if rebake or row.refused or not row.placement or not (built / "scene.json").is_file():
            shutil.rmtree(built, ignore_errors=True)
            baked = bake_ours(model, folder, built)
            row.refused, row.cpu_s, row.placement = baked.refused, baked.cpu_s, baked.placement
            row.lacks = sorted({match for line in baked.warnings for match in LACKED.findall(line)})
            if row.refused:
                return
        ours = draw_ours(built, folder / "picture.png", size)
    if isinstance(ours, str):
        row.refused = ours
        return
    picture, manifest = ours
    theirs = three.draw(row.path, manifest, size, row.placement)
    row.flip, row.three = None, ""
    if isinstance(theirs, str):
        row.three = theirs
        theirs = error = np.full_like(picture, 0.5)
    else:
        flip, error_map = compare(picture, theirs)
        row.flip = round(flip, 4)
        error = np.repeat(error_map[..., None], 3, axis=2)
    beside = np.clip(np.hstack([picture, theirs, error]), 0, 1)
    (out / "pairs" / f"{row.key}.png").write_bytes(encode_png((beside * 255.0 + 0.5).astype(np.uint8)))


def show_all(
    models: list[Path], root: Path, out: Path, size: int, *, redo: float | None = None, redraw: bool = False
) -> list[Shown]:
    """Draws every model that results.json does not know; bakes again what has no FLIP or one of `redo` or
    more; draws all again where `redraw` says so. Returns the rows of `models`."""
    for name in ("pairs", "baked"):
        (out / name).mkdir(parents=True, exist_ok=True)
    known: dict[str, Shown] = {}
    if (out / "results.json").is_file():
        for entry in json.loads((out / "results.json").read_text(encoding="utf-8")):
            known[entry["key"]] = Shown(**entry)
    rows = []
    with tempfile.TemporaryDirectory() as profile, three_of(root, Path(profile)) as three:
        for k, model in enumerate(models):
            path, key = model.relative_to(root).as_posix(), key_of(model)
            row = known.setdefault(key, Shown(path, key))
            rows.append(row)
            new = row.cpu_s == 0.0
            wrong = redo is not None and (row.flip is None or row.flip >= redo)
            if not (new or wrong or redraw):
                continue
            row.path = path
            show(model, row, three, out, size, rebake=new or wrong)
            print(f"[{k + 1}/{len(models)}] {row.path}: {row}", flush=True)
            listed = json.dumps([asdict(one) for one in known.values()], indent=1)
            (out / "results.json.new").write_text(listed, encoding="utf-8")
            (out / "results.json.new").replace(out / "results.json")
    return rows


def _sheet(rows: list[Shown], out: Path, size: int) -> Image.Image:
    side = min(size, 256)
    sheet = Image.new("RGB", (COLUMNS * (3 * side + 8), ROWS * (side + 24)), "white")
    text = ImageDraw.Draw(sheet)
    for place, row in enumerate(rows):
        x, y = place % COLUMNS * (3 * side + 8), place // COLUMNS * (side + 24)
        with Image.open(out / "pairs" / f"{row.key}.png") as pair:
            sheet.paste(pair.convert("RGB").resize((3 * side, side)), (x, y + 20))
        text.text((x + 2, y + 4), f"{row.flip}  {row.path[-80:]} {' '.join(row.lacks)}", fill="black")
    return sheet


def draw_sheets(rows: list[Shown], out: Path, size: int) -> None:
    """Writes sheet_NN.png, lacking_NN.png and index.html, the worst first."""
    drawn = [row for row in rows if not row.refused]
    drawn.sort(key=lambda row: -(2.0 if row.flip is None else row.flip))
    for old in [*out.glob("sheet_*.png"), *out.glob("lacking_*.png")]:
        old.unlink()
    body = []
    groups = {
        "sheet": ("Drawn by both", [row for row in drawn if not row.lacks]),
        "lacking": (
            "With what the player or three.js leaves out on purpose",
            [row for row in drawn if row.lacks],
        ),
    }
    for name, (title, group) in groups.items():
        for page, first in enumerate(range(0, len(group), COLUMNS * ROWS)):
            _sheet(group[first : first + COLUMNS * ROWS], out, size).save(out / f"{name}_{page:02}.png")
        body.append(f"<h2>{title}: ours, three.js, FLIP</h2>")
        for row in group:
            image = f"<img loading='lazy' src='pairs/{row.key}.png' alt=''>"
            body.append(
                f"<figure>{image}<figcaption>{html.escape(f'{row.path}: {row}')}</figcaption></figure>"
            )
    body.append("<h2>No picture of ours</h2>")
    body += [f"<p>{html.escape(f'{row.path}: {row}')}</p>" for row in rows if row.refused]
    page_text = f"<!doctype html><meta charset='utf-8'><title>Models</title>{''.join(body)}"
    (out / "index.html").write_text(page_text, encoding="utf-8")


def summary(rows: list[Shown]) -> str:
    """Models, pictures and FLIP of each folder. empty: files without a surface."""
    lines = [
        "".join(f"{word:>9}" for word in ("models", "empty", "refused", "compared", "median", "p90", "worst"))
    ]
    folders = Counter(row.path.partition("/")[0] for row in rows)
    for name in [*folders, ""]:
        for lacking in (False, True):
            group = [row for row in rows if row.path.startswith(name) and bool(row.lacks) == lacking]
            flips = sorted(row.flip for row in group if row.flip is not None)
            empty = sum(row.empty for row in group)
            counts = [len(group), empty, sum(bool(row.refused) for row in group) - empty, len(flips)]
            shown = [statistics.median(flips), flips[int(0.9 * len(flips))], flips[-1]] if flips else []
            label = (name or "all") + (", with what one leaves out" if lacking else "")
            figures = [*(f"{count:9}" for count in counts), *(f"{value:9.4f}" for value in shown)]
            lines += [f"{''.join(figures)}  {label}"] if group else []
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("-o", dest="out", type=Path, default=ROOT / "build/sheets")
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--every", type=int, default=1, help="only every Nth model")
    parser.add_argument(
        "--without", action="append", default=[], metavar="NAME", help="leave out folders of this name"
    )
    parser.add_argument(
        "--redo", type=float, metavar="FLIP", help="bake again what has this FLIP or more, or none"
    )
    parser.add_argument("--redraw", action="store_true", help="draw all again from what is baked")
    arguments = parser.parse_args()
    folders = [folder.resolve() for folder in arguments.folders]
    models = models_below(folders, arguments.without)[:: arguments.every]
    common = Path(os.path.commonpath(folders))
    root = common if common.is_dir() else common.parent
    rows = show_all(models, root, arguments.out, arguments.size, redo=arguments.redo, redraw=arguments.redraw)
    draw_sheets(rows, arguments.out, arguments.size)
    print(summary(rows))


if __name__ == "__main__":
    main()
