"""The skies of a scene's keys of light, and the light of a fixed moment. Does not import numpy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from paradize.scene.settings import DaytimeKey, Scene


@dataclass(frozen=True)
class KeySky:
    """A cube map that keys show. name: of its artifact. keys: their indices. first_s: when it is first seen.
    spans_s: from when to when, seconds of the flight; where the loop closes one ends before it begins."""

    name: str
    faces: tuple[Path, ...]
    keys: tuple[int, ...]
    first_s: float
    spans_s: tuple[tuple[float, float], ...]


def key_skies(scene: Scene) -> list[KeySky]:
    """Returns the skies of a scene, each once, in the order of the keys: "sky", "sky_2" ... A scene without
    keys has that of [sky]."""
    if not scene.daytime:
        return [KeySky("sky", scene.sky.faces, (), 0.0, ())] if scene.sky else []
    users: dict[tuple[Path, ...], list[int]] = {}
    for i, key in enumerate(scene.daytime):
        faces = key.faces or (scene.sky.faces if scene.sky else ())
        users.setdefault(faces, []).append(i)
    times = [key.at_s for key in scene.daytime]
    skies = []
    for n, (faces, keys) in enumerate(users.items()):
        spans = tuple((times[i - 1], times[(i + 1) % len(times)]) for i in keys)
        first_s = min(0.0 if 0.0 < end <= begin else begin for begin, end in spans)
        skies.append(KeySky(f"sky_{n + 1}" if n else "sky", faces, tuple(keys), first_s, spans))
    return skies


def standing_light(scene: Scene) -> Scene:
    """Returns the scene lit as at the key that is nearest to its poster; as it is without keys."""
    if not scene.daytime:
        return scene
    key = poster_key(scene)
    sun = replace(key.sun, angular_diameter_deg=scene.sun.angular_diameter_deg)
    head = replace(scene.head, exposure=key.exposure)
    return replace(scene, head=head, sun=sun, ambient=key.ambient, fog=key.fog)


def poster_key(scene: Scene) -> DaytimeKey:
    """Returns the key that is nearest to the poster's second."""
    return min(scene.daytime, key=lambda key: abs(key.at_s - scene.head.poster_s))
