"""Broken files: the sound ones of the same folder, cut, with bytes changed, and under wrong names."""

from __future__ import annotations

from pathlib import Path

import numpy as np

SHARES = (0.0, 0.05, 0.3, 0.9)
CHANGES = 3  # changed copies of each file


def write_malformed(folder: Path) -> None:
    """Below malformed/: what `fuzzers` and lost connections leave of pictures and models."""
    rng = np.random.default_rng(1)
    sound = [path for room in ("images", "height") for path in sorted((folder / room).iterdir())]
    out = folder / "malformed"
    (out / "pictures").mkdir(parents=True)
    for path in sound:
        data = path.read_bytes()
        for k, share in enumerate(SHARES):
            (out / "pictures" / f"cut{k}_{path.name}").write_bytes(data[: int(share * len(data))])
        for k in range(CHANGES):
            wrong = bytearray(data)
            for at in rng.integers(0, min(len(data), 200), 4):
                wrong[at] = rng.integers(256)
            (out / "pictures" / f"changed{k}_{path.name}").write_bytes(wrong)
    (out / "obj-afl").mkdir()
    for k, path in enumerate(sorted((folder / "obj-nasty").rglob("*.obj"))):
        wrong = bytearray(path.read_bytes() or b"f")
        for at in rng.integers(0, len(wrong), 2):
            wrong[at] = rng.integers(256)
        (out / "obj-afl" / f"id_{k:03}").write_bytes(wrong)
        (out / f"{path.stem}.png").write_bytes(path.read_bytes())
