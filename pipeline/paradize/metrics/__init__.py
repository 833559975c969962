"""Errors in physical units. Each metric has one reference that no stage shares; ERRORS.md lists them."""

__all__ = [
    "atlas",
    "authored",
    "draw",
    "flight",
    "levels",
    "loading",
    "mapped_normal",
    "occlusion",
    "panorama",
    "picture",
    "quantised",
    "seen",
    "source",
    "surface",
    "switch",
    "tangent",
    "terrain",
    "texels",
]
