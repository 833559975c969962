"""Generates all sources of the island: python raw_assets/make/all.py [FOLDER]; default: raw_assets.

Images and sound are the same on every machine up to one step of the last bit.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import animals
import bar
import boat
import clouds
import driftwood
import effect
import grove
import jetty
import lamps
import music
import nearby
import palm
import pebbles
import rocks
import sand
import shells
import shrubs
import sky
import sound
import starfish
import terrain
import water

SOUNDS = (sound, nearby, music)
MODELS = (palm, jetty, bar, boat, lamps, grove, shells, pebbles, starfish, driftwood, rocks, animals, shrubs)
MAKERS = (terrain, sand, effect, water, sky, clouds, *SOUNDS, *MODELS)


def main(arguments: list[str]) -> int:
    """Runs every generator. Returns exit code 0, or 2 for wrong usage."""
    if len(arguments) > 1 or any(a.startswith("-") for a in arguments):
        print("usage: python raw_assets/make/all.py [FOLDER]", file=sys.stderr)
        return 2
    out = Path(arguments[0]) if arguments else Path(__file__).resolve().parents[1]
    for maker in MAKERS:
        begun = time.perf_counter()
        maker.make(out)
        print(f"{maker.__name__:8} {time.perf_counter() - begun:6.1f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
