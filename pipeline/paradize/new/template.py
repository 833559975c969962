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
_SUN_DEG = (225.0, 35.0)  # azimuth and elevation
_HAZE = "density_per_m = 0.002"
_DAY = f"""# the afternoon sun; the sky's sun stands at the same place
[sun]
azimuth_deg = {_SUN_DEG[0]}
elevation_deg = {_SUN_DEG[1]}
color = [1.0, 0.86, 0.66]
intensity = 4.0

[ambient]
color = [0.62, 0.72, 0.88]
intensity = 0.35

# hides the horizon
[fog]
color = [0.74, 0.84, 0.93]
{_HAZE}

"""
# The player draws the moon's disc, and stars. Two keys are the least.
_NIGHT = "# moonlight; more keys, with a sun and skies of their own, make a sunrise\n" + "".join(
    f"""[[daytime]]
at_s = {second}
sun = {{ azimuth_deg = 320.0, elevation_deg = -30.0, intensity = 0.0 }}
moon = {{ azimuth_deg = 140.0, elevation_deg = 30.0, intensity = 0.4 }}
ambient = {{ color = [0.35, 0.5, 0.9], intensity = 0.1 }}
fog = {{ color = [0.015, 0.023, 0.045], {_HAZE} }}

"""
    for second in (0.0, 20.0)
)


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
        night = template == "night"
        if night:
            write_night_sky(aside / "sky")
        else:
            write_sky(aside / "sky", _direction(*_SUN_DEG))
        text = _text("island").replace("@name", name).replace("@light\n", _NIGHT if night else _DAY)
        if night:
            write_lanterns(aside)
            before, mark, after = text.partition("# A loop of yours")
            text = before.rstrip("\n") + "\n" + _text("night") + "\n" + mark + after
        return text.replace("@flight\n", flight_text()), None

    files, _ = new_folder(folder, fill)
    return NewScene(resolved(folder) / "scene.toml", name, files, [])


def _text(template: str) -> str:
    return read_file(Path(__file__).with_name("templates") / f"{template}.toml", _TEXT_BYTES).decode()


def _direction(azimuth_deg: float, elevation_deg: float) -> tuple[float, float, float]:
    azimuth, elevation = azimuth_deg * pi / 180.0, elevation_deg * pi / 180.0
    return cos(elevation) * sin(azimuth), sin(elevation), -cos(elevation) * cos(azimuth)
