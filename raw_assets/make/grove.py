"""Makes the plants of the dunes: a grove of palms in the east, and tufts of beach grass.

Usage: python grove.py RAW_ASSETS, after palm.py
Writes where each stands, grove/tall.csv, leaning.csv, young.csv, grass.csv and far_grass.csv, and the models
grove/grass.obj and far_grass.obj, whose blades are coloured by vertex. far_grass, of fewer and wider blades,
stands where the flight sees it from afar alone. Nothing stands in the way of the flight, on the beach or in
the water.
"""

from __future__ import annotations

import math
import sys
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from noise import fbm, smoothstep
from objfile import write_mtl
from paint import rand
from terrain import height_at

Floats = NDArray[np.float64]
Density = Callable[[float, float], float]  # of x and z, metres: 0 to 1

FAR_M = 10.0  # from the camera's way
ROOT_COLOR = (0.46, 0.42, 0.17)  # sRGB
TIP_COLOR = (0.72, 0.78, 0.30)
# x, z, radii along and across, turn of the long axis, degrees
GROVE = (25.0, -21.0, 20.0, 11.0, -28.0)
CLEAR_M = 5.5  # from the camera's way, where crowns reach its height
LOWEST_M = 1.1  # above the sea
EDGE = 0.33  # `in_grove` where palms lean outwards
CROWN_M = 4.6  # of a leaning palm, from its foot


def flight_way(island: Path) -> Floats:
    """The camera's way points as (n, 3)."""
    scene = tomllib.loads(island.read_text(encoding="utf-8"))
    return np.array([row["position"] for row in scene["flight"]["eye"]])


def distance_to_way(way: Floats, x: float, z: float) -> float:
    """Horizontal distance to the closed polyline through the way points, metres."""
    return distance_to_line(way[:, (0, 2)], np.array([x, z]))


def distance_to_line(points: Floats, at: Floats) -> float:
    """Distance to the closed polyline through the points, (n, dimensions)."""
    along = np.roll(points, -1, axis=0) - points
    share = ((at - points) * along).sum(axis=1) / (along * along).sum(axis=1)
    nearest = points + np.clip(share, 0.0, 1.0)[:, None] * along
    return float(np.sqrt(((nearest - at) ** 2).sum(axis=1)).min())


def in_grove(x: float, z: float) -> float:
    """1 in the middle of the grove, 0 at its edge and beyond."""
    middle_x, middle_z, along, across, turn_deg = GROVE
    turn = math.radians(turn_deg)
    u = math.cos(turn) * (x - middle_x) - math.sin(turn) * (z - middle_z)
    v = math.sin(turn) * (x - middle_x) + math.cos(turn) * (z - middle_z)
    return max(0.0, 1.0 - math.hypot(u / along, v / across))


def leaning_yaw_deg(x: float, z: float, way: Floats, chance: float) -> float | None:
    """The turn of a palm at x, z that leans out of the grove for light; None where its crown would come too
    near the camera's way. chance: 0 to 1."""
    yaw = math.atan2(x - GROVE[0], z - GROVE[1]) + math.radians(50.0 * (chance - 0.5))
    crown_x, crown_z = x + CROWN_M * math.sin(yaw), z + CROWN_M * math.cos(yaw)
    return math.degrees(yaw) % 360.0 if distance_to_way(way, crown_x, crown_z) > CLEAR_M else None


def grassy(x: float, z: float) -> float:
    """Where grass grows: under the palms, and in patches on the dunes."""
    patches = float(fbm(np.array([x / 9.0]), np.array([z / 9.0]), 71, 3)[0])
    high = float(smoothstep(1.3, 2.6, np.array([height_at(x, z)]))[0])
    return min(1.0, 1.6 * in_grove(x, z) + high * max(0.0, 2.2 * patches - 0.25))


def scattered(count: int, gap_m: float, clear_m: float, seed: int, way: Floats, density: Density) -> Floats:
    """(n, 3): at most `count` places at least `gap_m` apart, by dart throwing."""
    found: list[tuple[float, float, float]] = []
    for k in range(400 * count):
        x, z = 140.0 * rand(2 * k, seed) - 70.0, 140.0 * rand(2 * k + 1, seed) - 70.0
        if rand(k, seed + 1) >= density(x, z) or any(math.hypot(x - a, z - c) < gap_m for a, _, c in found):
            continue
        y = height_at(x, z)
        if y > LOWEST_M and distance_to_way(way, x, z) > clear_m:
            found.append((x, y, z))
        if len(found) == count:
            break
    return np.array(found)


def write_places(
    path: Path,
    places: Floats,
    seed: int,
    *,
    scale: tuple[float, float],
    lean_deg: float,
    yaws_deg: Sequence[float] | None = None,
) -> None:
    """Writes a file of instances, leaning, scaled and, unless `yaws_deg` says how, turned by chance."""
    lines = ["x,y,z,yaw_deg,pitch_deg,roll_deg,scale"]
    for k, (x, y, z) in enumerate(places):
        r = [rand(4 * k + i, seed) for i in range(4)]
        yaw_deg = 360.0 * r[0] if yaws_deg is None else yaws_deg[k]
        turns = f"{yaw_deg:.1f},{lean_deg * (2.0 * r[1] - 1.0):.1f},{lean_deg * (2.0 * r[2] - 1.0):.1f}"
        lines.append(f"{x:.2f},{y:.2f},{z:.2f},{turns},{scale[0] + (scale[1] - scale[0]) * r[3]:.3f}")
    path.write_text("\n".join(lines) + "\n", encoding="ascii", newline="\n")


def write_tuft(path: Path, blades: int, segments: int, widen: float) -> None:
    """Writes a tuft of beach grass: arched, pointed blades from one foot, darker at the root."""
    note = "A tuft of beach grass, made by raw_assets/make/grove.py; metres, Y up"
    text = [f"# {note}", "mtllib grass.mtl"]
    faces = []
    for k in range(blades):
        r = [rand(8 * k + i, 41) for i in range(6)]
        turn, lean = 2.0 * math.pi * (k + 0.8 * r[0]) / blades, 0.4 + 1.0 * r[1]
        length, width = 0.26 + 0.30 * r[2], widen * (0.011 + 0.007 * r[3])
        out = np.array([math.cos(turn), 0.0, math.sin(turn)])
        side = np.array([-math.sin(turn), 0.0, math.cos(turn)])
        spine = 0.05 * r[4] * out - np.array([0.0, 0.04, 0.0])  # below the sand, as slopes fall away
        first = k * (2 * segments + 1) + 1
        for i in range(segments + 1):
            s = i / segments
            color = [
                a + (b - a) * s * (0.75 + 0.5 * r[5]) for a, b in zip(ROOT_COLOR, TIP_COLOR, strict=True)
            ]
            # Lit from above as the whole tuft is, not as a mirror.
            text += ["vn {:.4f} {:.4f} {:.4f}".format(*(0.5 * out + [0.0, math.sqrt(0.75), 0.0]))]
            for sign in (-1.0, 1.0) if i < segments else (0.0,):
                x, y, z = spine + sign * width * (1.0 - 0.92 * s) * side
                text.append(f"v {x:.5f} {y:.5f} {z:.5f} " + " ".join(f"{min(c, 1.0):.3f}" for c in color))
            pitch = 1.45 - lean * (s + 0.5 / segments - 1.0 / 6.0) * 1.3  # in the middle of a segment
            spine = spine + length / segments * (math.cos(pitch) * out + [0.0, math.sin(pitch), 0.0])
        for i in range(segments):
            v, n = first + 2 * i, k * (segments + 1) + i + 1
            a, b, c, d = f"{v}//{n}", f"{v + 1}//{n}", f"{v + 2}//{n + 1}", f"{v + 3}//{n + 1}"
            faces += [f"f {a} {b} {d}", f"f {a} {d} {c}"] if i < segments - 1 else [f"f {a} {b} {c}"]
    text += ["g blades", "usemtl blades", *faces]
    path.write_text("\n".join(text) + "\n", encoding="ascii", newline="\n")


def write_grass(folder: Path, way: Floats) -> None:
    """Writes the tufts near the flight and those that it sees from afar, and their material."""
    places = scattered(700, 0.35, 1.2, 31, way, grassy)
    far = np.array([distance_to_line(way, place) > FAR_M for place in places])
    for name, chosen, seed in (("grass", places[~far], 32), ("far_grass", places[far], 33)):
        write_places(folder / f"{name}.csv", chosen, seed, scale=(0.7, 1.5), lean_deg=6.0)
    write_tuft(folder / "grass.obj", blades=18, segments=3, widen=1.0)
    write_tuft(folder / "far_grass.obj", blades=12, segments=2, widen=1.5)
    note = "Beach grass, made by raw_assets/make/grove.py"
    write_mtl(folder / "grass.mtl", note, {"blades": ["Ka 0 0 0", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]})


def make(out: Path) -> None:
    """Writes the folder grove under out."""
    folder = out / "grove"
    folder.mkdir(parents=True, exist_ok=True)
    way = flight_way(Path(__file__).resolve().parents[1] / "island.toml")
    old = scattered(44, 2.9, CLEAR_M, 11, way, lambda x, z: in_grove(x, z) ** 0.5)
    young = scattered(56, 2.2, CLEAR_M, 23, way, lambda x, z: float(0.0 < in_grove(x, z) < 0.5))
    near = [all(math.hypot(x - a, z - c) > 1.8 for a, _, c in old) for x, _, z in young]
    # of the old ones, those that lean stand at the edge
    yaws = [
        leaning_yaw_deg(x, z, way, rand(k, 14)) if in_grove(x, z) < EDGE else None
        for k, (x, _, z) in enumerate(old)
    ]
    leans = np.array([yaw is not None for yaw in yaws])
    write_places(folder / "tall.csv", old[~leans], 12, scale=(0.64, 1.12), lean_deg=5.0)
    write_places(
        folder / "leaning.csv",
        old[leans],
        13,
        scale=(0.76, 1.06),
        lean_deg=4.0,
        yaws_deg=[yaw for yaw in yaws if yaw is not None],
    )
    write_places(folder / "young.csv", young[near], 24, scale=(0.75, 1.2), lean_deg=5.0)
    write_grass(folder, way)


if __name__ == "__main__":
    make(Path(sys.argv[1]))
