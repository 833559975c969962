"""Reads a scene from one TOML file into frozen settings. Each field has a default, unit, range and meaning;
reference.py writes FIELDS.md from them.

Axes: right-handed, Y up, metres. Angles in the file are degrees (`_deg`). Colours are linear RGB. Azimuth
turns clockwise seen from above, from north (-Z, row 0 of the heightmap) to east (+X): 0 = -Z, 90 = +X. Files
are in the folder of the TOML or below it. Does not import numpy, so that a bake with nothing to do stays
fast.

Limits of the file: 4 MiB (documents.TOML_BYTES), keys of 16 parts (a.b.c has three), 64 nested tables and
lists, whole numbers of 64 bits, 10,000 tables in an array unless declared otherwise. Reading stops after 100
faults (schema.MOST_FAULTS).
"""

from paradize.scene.settings.daytime import DaytimeKey, KeyMoon
from paradize.scene.settings.environment import Sky, Sun, View, Water
from paradize.scene.settings.flight import EyePoint, Flight, FreeCamera, TargetPoint
from paradize.scene.settings.lights import Light
from paradize.scene.settings.load import load_scene
from paradize.scene.settings.motion import Beat, Motion
from paradize.scene.settings.objects import (
    RESERVED,
    Instance,
    ObjectMaterial,
    SceneObject,
)
from paradize.scene.settings.relief import FILTERS, Relief
from paradize.scene.settings.scene import Head, Scene, Waiver
from paradize.scene.settings.sound import Music, NeededSound, Sound, sound_files
from paradize.scene.settings.terrain import Terrain

__all__ = [
    "FILTERS",
    "RESERVED",
    "Beat",
    "DaytimeKey",
    "EyePoint",
    "Flight",
    "FreeCamera",
    "Head",
    "Instance",
    "KeyMoon",
    "Light",
    "Motion",
    "Music",
    "NeededSound",
    "ObjectMaterial",
    "Relief",
    "Scene",
    "SceneObject",
    "Sky",
    "Sound",
    "Sun",
    "TargetPoint",
    "Terrain",
    "View",
    "Waiver",
    "Water",
    "load_scene",
    "sound_files",
]
