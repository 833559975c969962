"""The maps of a material, said once: what each holds, how it is stored, measured and shown, and who has it.

Bakers, budgets, trim, check, report, explain and scene.json take names and facts from here. The player has a
list of its own: `player/assets/scene/object_maps.hpp`. "To add a map" in `pipeline/README.md` lists all
files.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["color", "normal", "value", "offset"]


@dataclass(frozen=True)
class MaterialMap:
    """One kind of map.

    name: in file names, scene.json and on the command line. label: in words.
    kind: what a texel holds: "color" (sRGB, perhaps with alpha), "normal" (x and y of a unit vector),
    "value" (each channel 0..1 by itself), "offset" (x and y, -1..1, without mean).
    channels: of a texel, alpha aside. formats: KTX2's, from the smallest to the most exact. alpha_formats:
    the same where there is alpha.
    surfaces: who may have it: "object", "water", "ground".
    stream_rank: what of a surface is streamed first.
    derived: made by `paradize maps` of a colour or a height picture. authored: may be baked from a picture
    of itself.
    narrow_formats: the same where only the first channel is read.
    panels: what a contact sheet shows of it, one after the other; of a "value" one for each channel.
    not_bounded: what the bound of its error does not hold, in the words of `paradize explain`.
    """

    name: str
    label: str
    kind: Kind
    channels: int
    formats: tuple[str, ...]
    surfaces: tuple[str, ...]
    stream_rank: int
    panels: tuple[str, ...]
    not_bounded: tuple[str, ...]
    alpha_formats: tuple[str, ...] = ()
    narrow_formats: tuple[str, ...] = ()
    derived: bool = True
    authored: bool = True

    @property
    def is_direction(self) -> bool:
        """Whether its error is an angle; else it is a PSNR."""
        return self.kind in ("normal", "offset")

    @property
    def metrics(self) -> tuple[str, ...]:
        """The errors that stand for it in tables, the first above all."""
        parts = ("p99_deg", "mean_deg", "max_deg") if self.is_direction else ("psnr_db",)
        return tuple(f"{self.name}_{part}" for part in parts)

    @property
    def worst(self) -> str:
        """The largest error of a level, by its name in `levels`."""
        return "max_deg" if self.is_direction else "max"


MAPS: dict[str, MaterialMap] = {
    material_map.name: material_map
    for material_map in (
        MaterialMap(
            name="color",
            label="colour",
            kind="color",
            channels=3,
            formats=("BC1_RGB_SRGB", "BC7_SRGB", "RGBA8_SRGB"),
            alpha_formats=("BC3_SRGB", "BC7_SRGB", "RGBA8_SRGB"),
            surfaces=("object", "ground"),
            stream_rank=0,
            panels=("colour",),
            not_bounded=("light",),
            derived=False,
            authored=False,
        ),
        MaterialMap(
            name="normal",
            label="normal",
            kind="normal",
            channels=2,
            formats=("BC5_SNORM", "RG8_SNORM", "RG16_SNORM"),
            surfaces=("object", "ground", "water"),
            stream_rank=1,
            panels=("normal, green up",),
            not_bounded=("mixes of texels", "light"),
        ),
        MaterialMap(
            name="height",
            label="height",
            kind="value",
            channels=1,
            formats=("BC4_UNORM", "R8_UNORM", "R16_UNORM"),
            surfaces=("object",),
            stream_rank=4,
            panels=("height",),
            not_bounded=("what parallax makes of it",),
        ),
        MaterialMap(
            name="gloss",
            label="gloss",
            kind="value",
            channels=2,
            formats=("BC5_UNORM", "RG8_UNORM", "RG16_UNORM"),
            surfaces=("object",),
            stream_rank=3,
            panels=("gloss R: specular intensity", "gloss G: smoothness"),
            not_bounded=("light",),
        ),
        MaterialMap(
            name="dudv",
            label="du/dv",
            kind="offset",
            channels=2,
            formats=("RG8_SNORM",),
            surfaces=("water",),
            stream_rank=2,
            panels=("du/dv, stretched",),
            not_bounded=("mixes of texels", "what the water makes of it"),
            authored=False,
        ),
        MaterialMap(
            name="occlusion",
            label="occlusion",
            kind="value",
            channels=2,
            formats=("BC5_UNORM", "RG8_UNORM", "RG16_UNORM"),
            narrow_formats=("BC4_UNORM", "R8_UNORM", "R16_UNORM"),
            surfaces=("object",),
            stream_rank=5,
            panels=("occlusion R", "occlusion G: metalness"),
            not_bounded=("light",),
            derived=False,
        ),
        MaterialMap(
            name="emission",
            label="emission",
            kind="color",
            channels=3,
            formats=("BC1_RGB_SRGB", "BC7_SRGB", "RGBA8_SRGB"),
            surfaces=("object",),
            stream_rank=6,
            panels=("emission",),
            not_bounded=("light",),
            derived=False,
            authored=False,
        ),
    )
}
DERIVED = tuple(name for name, material_map in MAPS.items() if material_map.derived)
AUTHORED = tuple(name for name, material_map in MAPS.items() if material_map.authored)
# Of an object's maps, those that may lie on second texture coordinates (material.SECOND_ROLES).
SECOND = ("normal", "gloss", "occlusion", "emission")


def maps_of(surface: str) -> tuple[str, ...]:
    """The names of the maps that a surface may have: "object", "water" or "ground"."""
    return tuple(name for name, material_map in MAPS.items() if surface in material_map.surfaces)
