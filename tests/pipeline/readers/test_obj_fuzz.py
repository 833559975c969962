"""Broken OBJ text: models of others with bytes changed, cut, doubled and swapped are read or refused, and the
plain way through a file gives what the careful way gives."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from paradize.errors import SourceError
from paradize.kernels.obj import ParsedObj, parse_obj, parse_obj_file
from paradize.readers.obj import read_obj
from tests.sweeps import CORPUS_DEEP

PIECES = [b"\n", b"\r", b"\r\n", b"\\\n", b" ", b"\t", b"/", b"//", b"-1", b"0", b"f ", b"v ", b"vt ", b"vn "]
PIECES += [
    b"nan",
    b"inf",
    b"1e999",
    b"-",
    b".",
    b"e5",
    b"#",
    b"\0",
    b"\xff\xfe",
    b"usemtl x\n",
    b"s 1\n",
    b"99999999",
]


def mutate(rng: np.random.Generator, text: bytes) -> bytes:
    for _ in range(int(rng.integers(1, 6))):
        at, stop = sorted(int(x) for x in rng.integers(0, len(text) + 1, 2))
        match int(rng.integers(0, 6)):
            case 0:
                text = text[:at] + PIECES[int(rng.integers(len(PIECES)))] + text[at:]
            case 1:
                text = text[:at] + bytes([int(rng.integers(256))]) + text[at + 1 :]
            case 2:
                text = text[:at] + text[min(stop, at + 40) :]
            case 3:
                text = text[: max(at, 10)]
            case 4:
                text = text[:at] + text[at : min(stop, at + 200)] * 2 + text[at:]
            case _:
                text = text.replace(PIECES[int(rng.integers(4))], PIECES[int(rng.integers(4))], 3)
    return text


def small_models(sources: Path) -> Iterator[bytes]:
    for folder in ("obj-nasty", "obj-kits"):
        for path in sorted((sources / folder).rglob("*.obj")):
            if path.stat().st_size < 20_000:
                yield path.read_bytes()


def check(path: Path, text: bytes) -> bool:
    path.write_bytes(text)
    try:
        read = read_obj(path)
    except SourceError as error:
        assert str(path) in str(error)
        return False
    mesh = read.mesh
    assert int(mesh.triangles.max()) < len(mesh.positions) and np.isfinite(mesh.positions).all()
    assert len(read.lines) == len(read.smoothing) == len(mesh.triangles)
    assert sum(group.count for group in mesh.groups) == len(mesh.triangles)
    return True


@CORPUS_DEEP
def test_mutated_models_are_read_or_refused(sources: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(20)
    models: list[bytes] = list(small_models(sources))
    outcomes = []
    for turn in range(750):
        outcomes.append(check(tmp_path / "a.obj", mutate(rng, models[turn % len(models)])))
    assert 75 < sum(outcomes) < 725, "both ways must be met"


@pytest.mark.deep
def test_many_more_mutated_models_are_read_or_refused(sources: Path, tmp_path: Path) -> None:
    models = list(small_models(sources))
    for seed in range(50):
        rng = np.random.default_rng(1000 + seed)
        for turn in range(1000):
            check(tmp_path / "a.obj", mutate(rng, models[(turn + seed) % len(models)]))


def same(a: ParsedObj, b: ParsedObj) -> bool:
    arrays = ("positions", "normals", "uvs", "colors", "triangles")
    return all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in arrays)


# Text that the fast path does not take, with the same meaning.
DETOURS: list[Callable[[bytes], bytes]] = [
    lambda text: text.replace(b"\n", b"\r\n"),
    lambda text: text.replace(b"\n", b"\r"),
    lambda text: text.replace(b" ", b"\t"),
    lambda text: text.replace(b" ", b"   "),
    lambda text: text.replace(b"\n", b" \n"),
    lambda text: b" " + text.replace(b"\n", b"\n "),
    lambda text: text.replace(b"\n", b" # said\n"),
    lambda text: text.replace(b"f ", b"f \\\n"),
    lambda text: text.rstrip(b"\n"),
    lambda text: b"\xef\xbb\xbf" + text,
]


def random_text(rng: np.random.Generator, count: int) -> bytes:
    """Vertices printed in many ways, and faces of every kind of corner."""
    forms = ["%.6f", "%.2f", "%g", "%.9g", "%d", "%.12f", "%.15e", "%.1f", "%+.4f"]
    lines = []
    for word, width in (("v", 3), ("vt", 2), ("vn", 3)):
        for row in rng.normal(0, 10.0 ** float(rng.integers(-6, 7)), (count, width)):
            form = forms[int(rng.integers(len(forms)))]
            lines.append(word + "".join(" " + form % value for value in row))
    corners = ["{0}", "{0}/{1}", "{0}//{2}", "{0}/{1}/{2}"]
    for _ in range(count):
        corner = corners[int(rng.integers(4))]
        sides = int(rng.integers(3, 6))
        lines.append("f " + " ".join(corner.format(*(rng.integers(1, count + 1, 3))) for _ in range(sides)))
        if rng.random() < 0.05:
            lines.append(f"usemtl m{int(rng.integers(3))}")
    return ("\n".join(lines) + "\n").encode()


@pytest.mark.parametrize("count", [1, 30, 4000])
def test_the_plain_way_and_the_careful_way_give_the_same_bytes(tmp_path: Path, count: int) -> None:
    """4000: more text than a block of the file, so that blocks end within lines."""
    rng = np.random.default_rng(count)
    text = random_text(rng, count)
    plain = parse_obj(text)
    assert not plain.faults and len(plain.triangles) >= count
    for detour in DETOURS:
        careful = detour(text)
        assert same(parse_obj(careful), plain)
        path = tmp_path / "a.obj"
        path.write_bytes(careful)
        with path.open("rb", buffering=0) as file:
            streamed = parse_obj_file(file.fileno())
        assert same(streamed, plain)
        assert np.array_equal(streamed.triangle_lines, parse_obj(careful).triangle_lines)


def test_printed_numbers_are_the_nearest_float32() -> None:
    rng = np.random.default_rng(4)
    for form in ("%.6f", "%.8f", "%.3f", "%.9g", "%.7e", "%.14f"):
        values = np.concatenate([rng.normal(0, 1, 3000), rng.normal(0, 1e5, 3000), rng.random(3000)])
        words = [form % value for value in values]
        # Halfway between two floats, written out whole: rounding twice would go wrong beside them.
        low = values[:300].astype(np.float32)
        words += [f"{value:.90f}" for value in (low.astype(float) + np.nextafter(low, np.float32(9e9))) / 2]
        wanted = np.array([float(word) for word in words])
        exact = np.array([float(np.float32(value)) for value in wanted])
        text = "".join(f"v {word} {i} 0\n" for i, word in enumerate(words))
        text += "".join(f"f {i} {i + 1} {i + 2}\n" for i in range(1, len(words) - 1))
        read = parse_obj(text.encode()).positions
        order = np.argsort(read[:, 1])
        assert np.array_equal(read[order, 0], exact.astype(np.float32)), form
