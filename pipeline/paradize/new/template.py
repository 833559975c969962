"""Writes the scene of a template: empty, island or night."""

from __future__ import annotations

from math import cos, pi, sin
from pathlib import Path

from paradize.files import read_file, resolved
from paradize.new.model import identifier
from paradize.new.scene import NewScene, new_folder
from paradize.new.sources import write_sand, write_sky
from paradize.new.templates.island import flight_text, write_lanterns, write_night_sky, write_sources

_TEXT_BYTES = 1 << 16
_DAY = ("the afternoon sun; the sky's sun stands at the same place", 225.0, 35.0, "[1.0, 0.86, 0.66]", 4.0)
_NIGHT = ("the moon; the sky's moon stands at the same place", 140.0, 30.0, "[0.6, 0.75, 1.0]", 0.4)
_AIR = {
    "island": ("[0.62, 0.72, 0.88]", 0.35, "[0.74, 0.84, 0.93]"),
    "night": ("[0.35, 0.5, 0.9]", 0.1, "[0.015, 0.023, 0.045]"),
}


def new_from_template(folder: Path, template: str) -> NewScene:
    """Makes `folder`, which must not exist or be empty, with the scene of a template, one of
    templates.TEMPLATES.

    Raises BakeError where the folder holds something or cannot be written.
    """
    name = identifier(folder.name, "scene")

    def fill(aside: Path) -> tuple[str, None]:
        if template == "empty":
            write_sky(aside / "sky", _direction(135.0, 40.0))
            return _text("empty").replace("@name", name), None
        write_sources(aside)
        write_sand(aside / "sand.png")
        light = _DAY if template == "island" else _NIGHT
        write = write_sky if template == "island" else write_night_sky
        write(aside / "sky", _direction(light[1], light[2]))
        text = _text("island").replace("@name", name).replace("@light\n", _light(template, light))
        if template == "night":
            write_lanterns(aside)
            before, mark, after = text.partition("# A loop of yours")
            text = before.rstrip("\n") + "\n" + _text("night") + "\n" + mark + after
        return text.replace("@flight\n", flight_text()), None

    files, _ = new_folder(folder, fill)
    return NewScene(resolved(folder) / "scene.toml", name, files, [])


def _text(template: str) -> str:
    return read_file(Path(__file__).with_name("templates") / f"{template}.toml", _TEXT_BYTES).decode()


def _light(template: str, light: tuple[str, float, float, str, float]) -> str:
    """The tables of the sun, of light from all sides, and of fog."""
    what, azimuth_deg, elevation_deg, color, intensity = light
    ambient, strength, haze = _AIR[template]
    return (
        f"# {what}\n[sun]\nazimuth_deg = {azimuth_deg}\nelevation_deg = {elevation_deg}\ncolor = {color}\n"
        f"intensity = {intensity}\n\n[ambient]\ncolor = {ambient}\nintensity = {strength}\n\n"
        f"# hides the horizon\n[fog]\ncolor = {haze}\ndensity_per_m = 0.002\n\n"
    )


def _direction(azimuth_deg: float, elevation_deg: float) -> tuple[float, float, float]:
    azimuth, elevation = azimuth_deg * pi / 180.0, elevation_deg * pi / 180.0
    return cos(elevation) * sin(azimuth), sin(elevation), -cos(elevation) * cos(azimuth)
