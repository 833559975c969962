"""Decodes BC7 blocks as the hardware does; shares nothing with the encoder.

Source: Khronos, "Data Format Specification 1.3", chapter BPTC. The result is defined in integers, so it is
exact. A reserved mode (eight zero bits) decodes to transparent black.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    U8 = npt.NDArray[np.uint8]
    Ints = npt.NDArray[np.int32]


class _Mode(NamedTuple):
    """Bits of the fields of a mode, in the order of the specification's table (NS PB RB ISB CB AB EPB SPB IB
    IB2)."""

    subsets: int
    partition: int
    rotation: int
    selector: int
    color: int
    alpha: int
    p_per_end: int
    p_per_subset: int
    indices: int
    second: int


_MODES = (
    _Mode(3, 4, 0, 0, 4, 0, 1, 0, 3, 0),
    _Mode(2, 6, 0, 0, 6, 0, 0, 1, 3, 0),
    _Mode(3, 6, 0, 0, 5, 0, 0, 0, 2, 0),
    _Mode(2, 6, 0, 0, 7, 0, 1, 0, 2, 0),
    _Mode(1, 0, 2, 1, 5, 6, 0, 0, 2, 3),
    _Mode(1, 0, 2, 0, 7, 8, 0, 0, 2, 2),
    _Mode(1, 0, 0, 0, 7, 7, 1, 0, 4, 0),
    _Mode(2, 6, 0, 0, 5, 5, 1, 0, 2, 0),
)
_BATCH = 1 << 13  # blocks decoded together, about 20 MB
_WEIGHTS = {
    2: np.array([0, 21, 43, 64], np.uint16),
    3: np.array([0, 9, 18, 27, 37, 46, 55, 64], np.uint16),
    4: np.array([0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64], np.uint16),
}

# Partitions: the subset of each texel, row by row, then the anchors of subsets 1 and 2.
_TWO = """
0011001100110011:15 0001000100010001:15 0111011101110111:15 0001001100110111:15 0000000100010011:15
0011011101111111:15 0001001101111111:15 0000000100110111:15 0000000000010011:15 0011011111111111:15
0000000101111111:15 0000000000010111:15 0001011111111111:15 0000000011111111:15 0000111111111111:15
0000000000001111:15 0000100011101111:15 0111000100000000:2 0000000010001110:8 0111001100010000:2
0011000100000000:2 0000100011001110:8 0000000010001100:8 0111001100110001:15 0011000100010000:2
0000100010001100:8 0110011001100110:2 0011011001101100:2 0001011111101000:8 0000111111110000:8
0111000110001110:2 0011100110011100:2 0101010101010101:15 0000111100001111:15 0101101001011010:6
0011001111001100:8 0011110000111100:2 0101010110101010:8 0110100101101001:15 0101101010100101:15
0111001111001110:2 0001001111001000:8 0011001001001100:2 0011101111011100:2 0110100110010110:2
0011110011000011:15 0110011010011001:15 0000011001100000:6 0100111001000000:6 0010011100100000:2
0000001001110010:6 0000010011100100:8 0110110010010011:15 0011011011001001:15 0110001110011100:2
0011100111000110:2 0110110011001001:15 0110001100111001:15 0111111010000001:15 0001100011100111:15
0000111100110011:15 0011001111110000:2 0010001011101110:2 0100010001110111:15
"""
_THREE = """
0011001102212222:3:15 0001001122112221:3:8 0000200122112211:15:8 0222002200110111:15:3
0000000011221122:8:15 0011001100220022:3:15 0022002211111111:15:3 0011001122112211:15:8
0000000011112222:8:15 0000111111112222:8:15 0000111122222222:6:15 0012001200120012:6:15
0112011201120112:6:15 0122012201220122:5:15 0011011211221222:3:15 0011200122002220:3:8
0001001101121122:3:15 0111001120012200:3:8 0000112211221122:8:15 0022002200221111:15:3
0111011102220222:3:15 0001000122212221:3:8 0000001101220122:6:15 0000110022102210:10:8
0122012200110000:5:3 0012001211222222:8:15 0110122112210110:8:6 0000011012211221:6:10
0022110211020022:8:15 0110011020022222:5:15 0011012201220011:15:10 0000200022112221:15:8
0000000211221222:8:15 0222002200120011:15:3 0011001200220222:3:15 0120012001200120:5:10
0000111122220000:6:10 0120120120120120:10:8 0120201212010120:8:9 0011220011220011:15:10
0011112222000011:15:6 0101010122222222:3:15 0000000021212121:15:8 0022112200221122:5:15
0022001100220011:15:3 0220122102201221:15:6 0101222222220101:15:6 0000212121212121:15:8
0101010101012222:3:15 0222011102220111:15:3 0002111200021112:5:15 0000211221122112:5:15
0222011101110222:5:15 0002111211120002:8:15 0110011001102222:5:15 0000000021122112:10:15
0110011022222222:5:15 0022001100110022:10:15 0022112211220022:8:15 0000000000002112:13:15
0002000100020001:15:3 0222122202221222:12:15 0101222222222222:3:15 0111201122012220:3:8
"""


def _table(text: str, subsets: int) -> tuple[U8, Ints]:
    """The subset of each texel (64, 16) and the anchor of each subset (64, subsets)."""
    entries = [entry.split(":") for entry in text.split()]
    owner = np.array([[int(digit) for digit in digits] for digits, *_ in entries], np.uint8)
    anchors = np.array([[0, *map(int, rest)] for _, *rest in entries], np.int32)
    if owner.shape != (64, 16) or anchors.shape != (64, subsets):
        raise AssertionError("a table of partitions is incomplete")
    return owner, anchors


_TABLES = {
    1: (np.zeros((64, 16), np.uint8), np.zeros((64, 1), np.int32)),
    2: _table(_TWO, 2),
    3: _table(_THREE, 3),
}


class _Reader:
    """Reads fields of many blocks of one mode, lowest bit first. blocks: (n, 16) uint8."""

    def __init__(self, blocks: U8, start: int) -> None:
        words = np.ascontiguousarray(blocks).view("<u8").astype(np.uint64)
        self.low, self.high = words[:, 0], words[:, 1]
        self.position = start

    def _section(self, count: int) -> npt.NDArray[np.uint64]:
        """The next `count` bits, 63 at most, as (n,) uint64."""
        position, self.position = self.position, self.position + count
        if position >= 64:
            section = self.high >> np.uint64(position - 64)
        elif position == 0:
            section = self.low
        else:
            section = (self.low >> np.uint64(position)) | (self.high << np.uint64(64 - position))
        return section & np.uint64((1 << count) - 1)

    def take(self, count: int) -> Ints:
        """The next `count` bits as (n,) int32."""
        return self._section(count).astype(np.int32)

    def take_indices(self, count: int, anchors: Ints) -> Ints:
        """Sixteen indices of `count` bits (n, 16); the indices of anchors (n, subsets) have one bit less."""
        section = self._section(16 * count - anchors.shape[1])
        before = (np.arange(16) > anchors[:, :, None]).sum(axis=1)
        widths = count - (np.arange(16) == anchors[:, :, None]).any(axis=1)
        index = section[:, None] >> (count * np.arange(16) - before).astype(np.uint64)
        cut: Ints = index.astype(np.int32) & ((1 << widths) - 1).astype(np.int32)
        return cut


def _expanded(codes: Ints, bits: int) -> Ints:
    """Expands codes of `bits` bits to 0..255 by repeating the highest bits below the lowest."""
    high = codes << (8 - bits)
    value: Ints = high | (high >> bits)
    return value


def _endpoints(reader: _Reader, mode: _Mode) -> Ints:
    """Endpoints (n, subsets, 2, 4) as 0..255; alpha is 255 in modes without it."""
    endpoints = np.full((len(reader.low), mode.subsets, 2, 4), 255, np.int32)
    channels = 4 if mode.alpha else 3
    for channel in range(channels):
        for subset in range(mode.subsets):
            for end in range(2):
                endpoints[:, subset, end, channel] = reader.take(mode.alpha if channel == 3 else mode.color)
    p_bits = 0
    for subset in range(mode.subsets if mode.p_per_end or mode.p_per_subset else 0):
        p_bits = 1
        p = reader.take(1)
        for end in range(2):
            if end and mode.p_per_end:
                p = reader.take(1)
            endpoints[:, subset, end, :channels] = endpoints[:, subset, end, :channels] * 2 + p[:, None]
    endpoints[..., :3] = _expanded(endpoints[..., :3], mode.color + p_bits)
    if mode.alpha:
        endpoints[..., 3] = _expanded(endpoints[..., 3], mode.alpha + p_bits)
    return endpoints


def _interpolate(ends: U8, index: Ints, bits: int) -> U8:
    """Texels (n, 16, 4) from endpoints (n, 16, 2, 4) and indices (n, 16)."""
    weight = _WEIGHTS[bits][index][:, :, None]
    sixty_fourths = ends[:, :, 0] * (64 - weight) + ends[:, :, 1] * weight + np.uint16(32)
    return (sixty_fourths >> 6).astype(np.uint8)


def _endpoints_of_texels(ends: Ints, owner: U8) -> U8:
    """The endpoints (n, 16, 2, 4) of each texel's subset, from those of the subsets (n, subsets, 2, 4)."""
    eight_bytes = ends.astype(np.uint8).reshape(len(ends), -1).view(np.uint64)
    own = np.take_along_axis(eight_bytes, owner.astype(np.int64), axis=1)
    return own.view(np.uint8).reshape(len(ends), 16, 2, 4)


def _decode_mode(blocks: U8, number: int) -> U8:
    """Blocks (n, 16) of one mode -> (n, 16, 4)."""
    mode = _MODES[number]
    reader = _Reader(blocks, number + 1)
    partition = reader.take(mode.partition)
    rotation = reader.take(mode.rotation)
    selector = reader.take(mode.selector)
    owner, anchors = _TABLES[mode.subsets]
    endpoints = _endpoints(reader, mode)
    endpoints_of_texels = _endpoints_of_texels(endpoints, owner[partition])
    index = reader.take_indices(mode.indices, anchors[partition])
    texels = _interpolate(endpoints_of_texels, index, mode.indices)
    if mode.second:
        second = reader.take_indices(mode.second, np.zeros((len(blocks), 1), np.int32))
        other = _interpolate(endpoints_of_texels, second, mode.second)
        swapped = (selector == 1)[:, None]
        color = np.where(swapped[:, :, None], other, texels)[..., :3]
        alpha = np.where(swapped, texels[..., 3], other[..., 3])
        texels = np.dstack([color, alpha])
        for channel in range(3):
            turned = rotation == channel + 1
            texels[turned, :, channel], texels[turned, :, 3] = (
                texels[turned, :, 3].copy(),
                texels[turned, :, channel].copy(),
            )
    return texels


def decode_bc7(blocks: U8) -> U8:
    """Blocks (n, 16) uint8 -> texels (n, 16, 4) uint8, row by row of each block."""
    out = np.zeros((len(blocks), 16, 4), np.uint8)
    for start in range(0, len(blocks), _BATCH):
        batch, decoded = blocks[start : start + _BATCH], out[start : start + _BATCH]
        first = batch[:, 0].astype(np.int32)
        for number in range(8):
            rows = np.flatnonzero((first & ((2 << number) - 1)) == 1 << number)
            if len(rows):
                decoded[rows] = _decode_mode(np.ascontiguousarray(batch[rows]), number)
    return out
