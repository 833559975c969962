"""Reads the map statements of MTL: options, then the name of a picture.

Format: Wavefront, "Advanced Visualizer Manual, Appendix B2. Material (.mtl)", 1992. A picture is searched
relative to the MTL file and must lie inside the root folder.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

from paradize.material import Channel, Wrap
from paradize.readers.names import inside, named_file, spelled_otherwise, why_missing

# Largest number of arguments of each option.
OPTIONS = {"-mm": 2, "-o": 3, "-s": 3, "-t": 3} | dict.fromkeys(
    ("-blendu", "-blendv", "-bm", "-boost", "-cc", "-clamp", "-imfchan", "-colorspace", "-texres", "-type"), 1
)
_MAX_WORDS = 64  # words before a map's name; all options together take half as many
_CHANNELS: dict[str, Channel] = {"r": "r", "g": "g", "b": "b", "m": "a", "l": "luminance"}
# Arguments of options that change nothing.
_NEUTRAL = {"-blendu": "on", "-blendv": "on", "-boost": "0", "-cc": "off"}


@dataclass
class MapStatement:
    """keyword: in small letters. file: of the picture. channel: None where the statement does not say.
    scale, offset: of u and v with v upwards: u * scale + offset. bump: -bm. base, gain: -mm, by
    which a value becomes base + gain * value. unused: options that have no effect here. note: what the user
    should know."""

    keyword: str
    file: Path
    line: int
    channel: Channel | None = None
    wrap: tuple[Wrap, Wrap] | None = None
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    bump: float | None = None
    base: float = 0.0
    gain: float | None = None
    unused: list[str] = field(default_factory=list)
    note: str = ""

    @property
    def height(self) -> float | None:
        """Height of full white in units of the model, as three.js and Blender count -bm; None where the
        statement does not say."""
        if self.bump is None and self.gain is None:
            return None
        return (1.0 if self.bump is None else self.bump) * (1.0 if self.gain is None else self.gain)


def floats(text: str, count: int) -> tuple[float, ...] | None:
    """`count` finite numbers, or None. For a colour one number stands for all three."""
    words = text.split()[:count]
    if not all(word.isascii() and "_" not in word for word in words):  # forms that only Python accepts
        return None
    try:
        values = [float(word) for word in words]
    except ValueError:
        return None
    if count == 3 and len(values) == 1:
        values *= 3
    if len(values) != count or not all(math.isfinite(value) for value in values):
        return None
    return tuple(values)


def read_map_statement(
    keyword: str, text: str, file: Path, line: int, root: Path, absent: list[Path] | None = None
) -> MapStatement | str:
    """A map statement without its keyword, or a text that says why it names no picture. A missing picture is
    appended to `absent`. Raises SourceError as `named_file`."""
    words = text.split(None, _MAX_WORDS)
    options, index = _options(words, 0, 1)
    # A name may contain several blanks in a row: without options the text is taken unchanged.
    name = " ".join(words[index:]) if index else text.strip()
    if not name:
        return "no file named"
    place, note = f"line {line} of {file}", ""
    path = inside(root, file.parent, name)
    if path is None or not named_file(path, place):
        # Maya writes options after the name.
        end = next((k for k in range(index + 1, len(words)) if words[k].lower() in OPTIONS), None)
        shorter = None if end is None else inside(root, file.parent, " ".join(words[index:end]))
        if end is not None and shorter is not None and named_file(shorter, place):
            path = shorter
            options |= _options(words, end, 0)[0]
        else:
            if absent is not None and path is not None:
                absent.append(path)
            other = spelled_otherwise(root, file.parent, name)
            if other is None and path is None:
                return f"{name[:120]!r} lies outside {root}; ignored: copy it beside the material file"
            if other is None and "://" in name:  # model:// of Gazebo, package:// of ROS, a web address
                return f"{name[:120]!r} is not followed; ignored: copy the picture beside the material file"
            if other is None:
                return f"{name[:120]!r} {why_missing(path)}; ignored: put it there, or correct the name"
            path, note = other
    statement = MapStatement(keyword, path, line, note=note)
    for option, arguments in options.items():
        if not _apply(statement, option, arguments):
            statement.unused.append(option)
    return statement


def _options(words: list[str], index: int, left: int) -> tuple[dict[str, list[str]], int]:
    """The options from words[index] on, each with its arguments, and the first word behind them. left: how
    many words are no argument."""
    options: dict[str, list[str]] = {}
    while index < len(words) and words[index].lower() in OPTIONS:
        option = words[index].lower()
        taken = options[option] = []
        index += 1
        for count in range(OPTIONS[option]):
            numbers = OPTIONS[option] > 1 and count
            if len(words) - index <= left or (numbers and floats(words[index], 1) is None):
                break
            taken.append(words[index])
            index += 1
    return options, index


def _apply(statement: MapStatement, option: str, arguments: list[str]) -> bool:
    """Whether an option is used, or changes nothing."""
    word = arguments[0].lower() if arguments else ""
    numbers = [value[0] for text in arguments if (value := floats(text, 1))]
    if OPTIONS[option] > 1 and len(numbers) < len(arguments):
        return False  # what is not a number counts for nothing
    if option == "-clamp" and word in ("on", "off"):
        statement.wrap = ("clamp", "clamp") if word == "on" else ("repeat", "repeat")
    elif option == "-imfchan" and word in _CHANNELS:
        statement.channel = _CHANNELS[word]
    elif option == "-s" and numbers:
        statement.scale = (numbers[0], numbers[1] if len(numbers) > 1 else 1.0)
    elif option == "-o" and numbers:
        statement.offset = (numbers[0], numbers[1] if len(numbers) > 1 else 0.0)
    elif option == "-bm" and numbers:
        statement.bump = numbers[0]
    elif option == "-mm" and len(numbers) == 2:
        statement.base, statement.gain = numbers
    elif option == "-t":
        return not any(numbers)
    else:
        return word == _NEUTRAL.get(option)
    return True
