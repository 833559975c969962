"""Renders the poster and ten seconds of the flight where there is no display.

usage: record.py PLAYER SCENE_DIR OUT_DIR
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import av

from paradize.cli.progress import progress

SECONDS = 10
FRAMES_PER_SECOND = 30
POSTER_SIZE = "1280x720"
FLIGHT_SIZE = "640x360"


def render(player: str, scene: Path, *arguments: object) -> None:
    """Runs the player without a display; its own message is all that a person needs when it fails."""
    command = [player, str(scene), "--headless", *map(str, arguments)]
    if subprocess.run(command, stdout=sys.stderr).returncode != 0:
        sys.exit(1)


def encode(frames: list[Path], video: Path, sound: Path | None = None) -> None:
    """Joins PNG frames, and a WAV file of their sound, into an MP4 that browsers play: H.264 and AAC."""
    with progress() as shown, av.open(str(video), "w") as container:
        stream = container.add_stream("libx264", rate=FRAMES_PER_SECOND)
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": "18", "preset": "veryfast"}
        stream.width, stream.height = map(int, FLIGHT_SIZE.split("x"))
        track = container.add_stream("aac", rate=44100, layout="stereo") if sound else None
        for number, path in enumerate(frames):
            shown.step("video", number, len(frames))
            with av.open(str(path)) as picture:
                frame = next(picture.decode(video=0)).reformat(format="yuv420p")
            frame.pts, frame.time_base = number, Fraction(1, FRAMES_PER_SECOND)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
        if sound and track:
            with av.open(str(sound)) as source:
                for heard in source.decode(audio=0):
                    container.mux(track.encode(heard))
            container.mux(track.encode())


def main() -> None:
    player, scene, out = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    manifest = json.loads((scene / "scene.json").read_text())
    poster_s = manifest["poster_s"]
    shutil.rmtree(out, ignore_errors=True)
    (out / "frames").mkdir(parents=True)
    print("no display: rendering the poster and ten seconds of the flight", file=sys.stderr)
    poster = out / "poster.png"
    render(player, scene, "--mute", "--time", poster_s, "--size", POSTER_SIZE, "--screenshot", poster)
    start_s = max(0.0, poster_s - SECONDS / 2)
    count = SECONDS * FRAMES_PER_SECOND
    name = out / "frames" / "flight.png"
    sound = out / "flight.wav" if manifest["sounds"] or manifest["music"] else None
    heard = ("--audio", sound) if sound else ("--mute",)
    render(
        player, scene, *heard, "--wait-resident", "--time", start_s, "--frames", count, "--size", FLIGHT_SIZE,
        "--screenshot", name,
    )  # fmt: skip
    frames = sorted(name.parent.glob("*.png"))
    if len(frames) != count:
        sys.exit(f"{name.parent}: {len(frames)} frames rendered, {count} asked for")
    video = out / "flight.mp4"
    encode(frames, video, sound)
    print(f"poster  {poster}\nflight  {video}\nframes  {name.parent}/")


if __name__ == "__main__":
    main()
