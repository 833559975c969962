"""Draws a scene's flight on sheets to look at: 24 moments of it, and strips of 60 frames in a row.

usage: contact_sheet.py PLAYER SCENE_DIR OUT_DIR [SECOND ...]     a strip begins at each second
"""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path

from PIL import Image, ImageDraw
from record import FLIGHT_SIZE, FRAMES_PER_SECOND, render

from paradize.cli.progress import progress

MOMENTS, COLUMNS = 24, 4
STRIP_FRAMES, STRIP_COLUMNS = 60, 6


def join(pictures: Sequence[Path], seconds: Sequence[float], columns: int, reduce: int, sheet: Path) -> None:
    """Writes pictures of one size row by row into one, each with its second. `reduce`: pixels of a picture
    along one of the sheet."""
    with Image.open(pictures[0]) as first:
        width, height = first.width // reduce, first.height // reduce
    out = Image.new("RGB", (columns * width, -(-len(pictures) // columns) * height))
    draw = ImageDraw.Draw(out)
    for number, (path, second) in enumerate(zip(pictures, seconds, strict=True)):
        corner = (number % columns * width, number // columns * height)
        with Image.open(path) as picture:
            out.paste(picture.convert("RGB").reduce(reduce), corner)
        place = (corner[0] + 6, corner[1] + 4)
        draw.text(place, f"{second:g} s", fill=(255, 255, 255), stroke_width=1, stroke_fill=(0, 0, 0))
    out.save(sheet)


def main() -> None:
    player, scene, out = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    duration_s = json.loads((scene / "scene.json").read_text())["flight"]["duration_s"]
    starts = [float(text) for text in sys.argv[4:]]
    shutil.rmtree(out, ignore_errors=True)
    (out / "frames").mkdir(parents=True)
    moments = [duration_s * number / MOMENTS for number in range(MOMENTS)]
    pictures = [out / "frames" / f"moment_{second:07.2f}.png" for second in moments]
    with progress() as shown:
        for done, (second, picture) in enumerate(zip(moments, pictures, strict=True)):
            shown.step("moments", done, MOMENTS)
            render(player, scene, "--mute", "--time", second, "--size", FLIGHT_SIZE, "--screenshot", picture)
    join(pictures, moments, COLUMNS, 1, out / "moments.png")
    print(f"moments {out / 'moments.png'}")
    for start in starts:
        name = out / "frames" / f"strip_{start:g}.png"
        render(
            player, scene, "--mute", "--wait-resident", "--time", start, "--frames", STRIP_FRAMES,
            "--size", FLIGHT_SIZE, "--screenshot", name,
        )  # fmt: skip
        frames = sorted(name.parent.glob(f"{name.stem}_*.png"))
        seconds = [round(start + number / FRAMES_PER_SECOND, 2) for number in range(len(frames))]
        join(frames, seconds, STRIP_COLUMNS, 2, out / name.name)
        print(f"strip   {out / name.name}")
    print(f"frames  {out / 'frames'}/")


if __name__ == "__main__":
    main()
