"""A contact sheet: the maps of one material as the hardware reads them, their mips and errors, and a lit
preview.

Drawn by Pillow. No artifact depends on it.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from paradize.files import bytes_text
from paradize.map_table import MAPS, maps_of
from paradize.metrics.texels import decode_texels
from paradize.preview.pictures import (
    MAX_SHOWN,
    MaterialDefaults,
    SheetMap,
    close_view,
    has_holes,
    lit_preview,
    picture_of,
    shown_level,
)
from paradize.preview.shade import to_srgb

if TYPE_CHECKING:
    import numpy.typing as npt

    F32 = npt.NDArray[np.float32]
    U8 = npt.NDArray[np.uint8]

_PAPER, _INK, _PALE, _LINE = (24, 25, 28), (236, 236, 232), (150, 152, 156), (58, 60, 66)
PREVIEW = 640  # pixels
_MARGIN, _GAP = 40, 24
_PANEL, _LARGE_PANEL = 312, 470  # the large one where there are at most two
_THUMBS = 7  # mips in a strip
_COLUMNS = 3
_ZOOM = 2  # pixels per texel in the close view


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


# Colour and shape first, then what follows from them.
SHEET_ORDER = tuple(dict.fromkeys(("color", "height", *MAPS)))


@dataclass(frozen=True)
class _Panel:
    """One picture of a map: of all its channels, or of one alone."""

    map: str
    title: str
    channel: int | None = None

    def picture(self, decoded: F32) -> U8:
        return picture_of(self.map, decoded, self.channel)


def _panels(maps: dict[str, SheetMap]) -> list[_Panel]:
    """The panels, in the order of the sheet."""
    out: list[_Panel] = []
    for name in (name for name in SHEET_ORDER if name in maps):
        titles = MAPS[name].panels
        if maps[name].texture.format in MAPS[name].narrow_formats:
            titles = titles[:1]
        many = len(titles) > 1
        out += [_Panel(name, title, k if many else None) for k, title in enumerate(titles)]
        if name == "color" and has_holes(maps[name].texture):
            out.append(_Panel(name, "alpha", 3))
    return out


def _fit(picture: U8, width: int, height: int) -> Image.Image:
    """A picture scaled to fit: enlarged by whole texels, reduced by area means."""
    image = Image.fromarray(picture)
    scale = min(width / image.width, height / image.height)
    size = max(1, round(image.width * scale)), max(1, round(image.height * scale))
    way = Image.Resampling.NEAREST if scale >= 1 else Image.Resampling.BOX
    return image.resize(size, way)


_UNITS = {"deg": "\u00b0", "db": " dB"}


def _error_text(name: str, value: float, kind: str) -> str:
    """`normal_p99_deg` of a normal map -> `p99 1.94\u00b0`."""
    words = name.removeprefix(f"{kind}_").split("_")
    unit = _UNITS.get(words[-1], "")
    text = f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"
    return f"{' '.join(words[:-1] if unit else words)} {text}{unit}"


def error_lines(kind: str, entry: SheetMap) -> list[str]:
    """The measured errors of a map as lines of text: of the whole map, then of each mip if they were
    measured."""
    if not entry.errors:
        return ["no error was measured"]
    lines = [_error_text(name, value, kind) for name, value in entry.errors.items()]
    if entry.levels:
        key = next(
            (k for k in ("p99_deg", "psnr_db") if k in entry.levels[0]), next(iter(entry.levels[0]), "")
        )
        digits = 1 if key == "psnr_db" else 2
        values = [f"{level[key]:.{digits}f}" for level in entry.levels if key in level]
        unit = _UNITS.get(key.rpartition("_")[2], "").strip()
        lines.append(f"{key.rpartition('_')[0] or key} by level, {unit}: {' '.join(values)}")
    return lines


class _Sheet:
    """A canvas that grows downwards."""

    def __init__(self, width: int) -> None:
        self.image = Image.new("RGB", (width, 4000), _PAPER)
        self.draw = ImageDraw.Draw(self.image)
        self.bottom = 0  # y below everything drawn
        self.lowest = 0  # y below the columns

    def text(
        self, at: tuple[int, int], text: str, size: int, color: tuple[int, int, int] = _INK, width: int = 0
    ) -> int:
        """Draws text, broken at spaces so that it stays within `width`; the y below it."""
        font, (x, y) = _font(size), at
        for line in self._broken(text, font, width) if width else [text]:
            self.draw.text((x, y), line, font=font, fill=color)
            y += round(size * 1.35)
        self.bottom = max(self.bottom, y)
        return y

    def _broken(self, text: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: int) -> list[str]:
        lines = [""]
        for word in text.split(" "):
            longer = f"{lines[-1]} {word}".strip()
            if lines[-1] and self.draw.textlength(longer, font=font) > width:
                lines.append(word)
            else:
                lines[-1] = longer
        return lines

    def paste(self, picture: Image.Image, at: tuple[int, int], box: tuple[int, int]) -> None:
        """A picture in the middle of a box with a thin frame."""
        x, y = at
        self.draw.rectangle((x - 1, y - 1, x + box[0], y + box[1]), outline=_LINE)
        self.image.paste(picture, (x + (box[0] - picture.width) // 2, y + (box[1] - picture.height) // 2))
        self.bottom = max(self.bottom, y + box[1])

    def png(self) -> bytes:
        out = io.BytesIO()
        self.image.crop((0, 0, self.image.width, self.bottom + _MARGIN)).save(out, "PNG", compress_level=1)
        return out.getvalue()


def _draw_panel(
    sheet: _Sheet, at: tuple[int, int], panel: _Panel, entry: SheetMap, wide: int, shape: float
) -> None:
    """Draws a map, its format and its mips. wide: width of the boxes; shape: their height divided by it."""
    texture = entry.texture
    x, y = at
    y = sheet.text((x, y), panel.title, 19)
    size = f"{texture.width} x {texture.height}"
    y = sheet.text((x, y), f"{texture.format}   {size}   {bytes_text(entry.bytes)}", 14, _PALE) + 4
    first = shown_level(texture, MAX_SHOWN // 2)
    tall = round(wide * shape)
    sheet.paste(_fit(panel.picture(decode_texels(texture, first)), wide, tall), (x, y), (wide, tall))
    y += tall + 8
    edge = (wide - 4 * (_THUMBS - 1)) // _THUMBS
    low = max(1, round(edge * shape))
    finest = shown_level(texture, 128)
    for index, level in enumerate(range(finest, min(finest + _THUMBS, len(texture.levels)))):
        left = x + index * (edge + 4)
        sheet.paste(_fit(panel.picture(decode_texels(texture, level)), edge, low), (left, y), (edge, low))
        sheet.text((left, y + low + 1), str(level), 11, _PALE)


def draw_sheet(title: str, subtitle: str, maps: dict[str, SheetMap], defaults: MaterialDefaults) -> bytes:
    """The sheet of one material as PNG. maps: any of paradize.map_table."""
    panels = _panels(maps)
    columns = max(1, min(_COLUMNS, len(panels)))
    left = _MARGIN + PREVIEW + 2 * _GAP
    wide = _PANEL if len(panels) > 2 else _LARGE_PANEL
    sheet = _Sheet(left + columns * (wide + _GAP) - _GAP + _MARGIN)
    sheet.text((_MARGIN, 28), title, 44)
    top = sheet.text((_MARGIN + 2, 86), subtitle, 17, _PALE) + 16

    preview = Image.fromarray(lit_preview(maps, defaults, PREVIEW))
    sheet.paste(preview, (_MARGIN, top), (PREVIEW, preview.height))
    y = sheet.text((_MARGIN, top + preview.height + 8), _about(defaults), 14, _PALE, PREVIEW) + 10
    _draw_close(sheet, y, maps)

    shape = max(min(1.0, m.texture.height / m.texture.width) for m in maps.values())
    height = round((wide + wide / _THUMBS) * shape) + 96
    for index, panel in enumerate(panels):
        at = left + index % columns * (wide + _GAP), top - 8 + index // columns * height
        _draw_panel(sheet, at, panel, maps[panel.map], wide, shape)
    low = top - 8 + -(-len(panels) // columns) * height + 12
    for index, (name, entry) in enumerate(maps.items()):
        if index % columns == 0 and index:
            low = sheet.lowest + 16
        x = left + index % columns * (wide + _GAP)
        y = sheet.text((x, low), ", ".join(filter(None, (MAPS[name].label, entry.tier))), 17)
        for line in error_lines(name, entry):
            y = sheet.text((x, y), line, 15, _PALE, wide)
        sheet.lowest = max(sheet.lowest, y)
    return sheet.png()


def _draw_close(sheet: _Sheet, top: int, maps: dict[str, SheetMap]) -> None:
    """Two maps enlarged so that each texel is visible."""
    half = (PREVIEW - _GAP) // 2
    close = [name for name in maps_of("object") if name in maps][:2]
    for index, name in enumerate(close):
        x = _MARGIN + index * (half + _GAP)
        view = picture_of(name, close_view(maps[name].texture, half // _ZOOM))
        enlarged = Image.fromarray(view).resize(
            (view.shape[1] * _ZOOM, view.shape[0] * _ZOOM), Image.Resampling.NEAREST
        )
        sheet.paste(enlarged, (x, top), (half, half))
        sheet.text(
            (x, top + half + 6), f"{MAPS[name].panels[0]}: the middle of level 0, {_ZOOM} x", 14, _PALE
        )


def _about(defaults: MaterialDefaults) -> str:
    """Describes the lit preview."""
    if defaults.about:
        return defaults.about
    shape = "a sphere, two tiles across" if defaults.tiles else "the whole map from above"
    return f"lit in linear light from what the hardware reads: {shape}, sun from the upper left"


def draw_sky(title: str, subtitle: str, entry: SheetMap, exposure: float) -> bytes:
    """The sheet of a cube map: its faces laid out as a cross, and the mips of the front."""
    texture = entry.texture
    edge = 300
    level = shown_level(texture, 512)
    sheet = _Sheet(2 * _MARGIN + 4 * edge)
    sheet.text((_MARGIN, 28), title, 44)
    top = sheet.text((_MARGIN + 2, 86), subtitle, 17, _PALE) + 16

    def face(index: int, at: int) -> U8:
        light = decode_texels(texture, at, index)[:, :, :3]
        return to_srgb(light * exposure / (1.0 + light * exposure) * np.float32(1.25))

    places = {
        0: (2, 1, "+X"),
        1: (0, 1, "-X"),
        2: (1, 0, "+Y"),
        3: (1, 2, "-Y"),
        4: (1, 1, "+Z"),
        5: (3, 1, "-Z"),
    }
    for index, (i, j, name) in places.items():
        at = _MARGIN + i * edge, top + j * edge
        sheet.paste(_fit(face(index, level), edge, edge), at, (edge, edge))
        sheet.draw.text(
            (at[0] + 10, at[1] + 8), name, font=_font(20), fill=_INK, stroke_width=2, stroke_fill=_PAPER
        )
    y = top + 3 * edge + 16
    for index, mip in enumerate(range(level + 1, min(level + 9, len(texture.levels)))):
        x = _MARGIN + index * 124
        sheet.paste(_fit(face(4, mip), 112, 112), (x, y), (112, 112))
        sheet.text((x, y + 114), f"+Z, level {mip}", 13, _PALE)
    y += 140
    for line in error_lines("sky", entry):
        y = sheet.text((_MARGIN, y), line, 15, _PALE, 4 * edge)
    return sheet.png()
