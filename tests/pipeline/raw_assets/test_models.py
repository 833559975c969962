"""The palm and the jetty in raw_assets: sound models, atlases that do not bleed, scripts that remake them."""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
import pytest
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from paradize.readers.model import read_model
from paradize.scene.flight import plan_flight
from paradize.scene.settings import load_scene
from tests.sweeps import sweep

ROOT = Path(__file__).resolve().parents[3]
RAW = ROOT / "raw_assets"
GUTTER_PX = 16
ATLAS_PX = {"palm": (1024, 1024), "jetty": (2048, 1024)}
ISLANDS = {
    "palm": 2 + 3 + 6,
    "jetty": 9 + 9 + 4 + 4,
}  # planks, ends, poles, tops


class Obj:
    """An OBJ of triangles, read here without the pipeline's reader: it is what the reader is given."""

    def __init__(self, path: Path) -> None:
        v: list[list[float]] = []
        vt: list[list[float]] = []
        vn: list[list[float]] = []
        faces, groups, materials = [], [], []
        group = material = ""
        for line in path.read_text(encoding="ascii").splitlines():
            word, *rest = line.split() or [""]
            if word in ("v", "vt", "vn"):
                {"v": v, "vt": vt, "vn": vn}[word].append([float(x) for x in rest])
            elif word == "g":
                group = rest[0]
            elif word == "usemtl":
                material = rest[0]
            elif word == "f":
                assert len(rest) == 3, line
                faces.append([[int(i) - 1 for i in corner.split("/")] for corner in rest])
                groups.append(group)
                materials.append(material)
        index = np.array(faces)
        self.count = len(index)
        self.groups, self.materials = np.array(groups), np.array(materials)
        self.points = np.array(v)[index[:, :, 0]]
        self.uvs = np.array(vt)[index[:, :, 1]]
        self.normals = np.array(vn)[index[:, :, 2]]


@pytest.fixture(scope="module", params=["palm", "jetty"])
def model(request: pytest.FixtureRequest) -> tuple[str, Obj]:
    return request.param, Obj(RAW / request.param / f"{request.param}.obj")


@pytest.fixture(scope="module")
def mask(model: tuple[str, Obj]) -> np.ndarray:
    """The texels that the model's layout covers, (height, width)."""
    name, obj = model
    return covered(obj.uvs, *ATLAS_PX[name])


@pytest.fixture(scope="module")
def scripts() -> Any:
    """The scripts of raw_assets/make, imported the way they import one another."""
    sys.path.insert(0, str(RAW / "make"))
    import animals
    import bar
    import boat
    import driftwood
    import grove
    import jetty
    import jetty_paint
    import lamps
    import palm
    import palm_paint
    import pebbles
    import rocks
    import shells
    import starfish

    yield {
        "animals": animals,
        "bar": bar,
        "boat": boat,
        "lamps": lamps,
        "driftwood": driftwood,
        "rocks": rocks,
        "shells": shells,
        "starfish": starfish,
        "grove": grove,
        "palm": palm,
        "palm_paint": palm_paint,
        "pebbles": pebbles,
        "jetty": jetty,
        "jetty_paint": jetty_paint,
    }
    sys.path.remove(str(RAW / "make"))


def read(path: Path) -> np.ndarray:
    image = oiio.ImageBuf(str(path))
    pixels = image.get_pixels(oiio.FLOAT)
    assert not image.has_error, image.geterror()
    return np.round(pixels * 255.0)


def areas(triangles: np.ndarray) -> np.ndarray:
    """Of triangles in space or in the plane: (n, 3, 3 or 2) -> (n,)."""
    flat = np.zeros((len(triangles), 3, 3))
    flat[..., : triangles.shape[2]] = triangles
    cross = np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])
    return np.asarray(0.5 * np.sqrt((cross**2).sum(axis=1)))


def covered(uvs: np.ndarray, width: int, height: int) -> np.ndarray:
    """The texels whose square a UV triangle touches, (height, width)."""
    mask = np.zeros((height, width), dtype=bool)
    for corners in uvs * [width, -height] + [0, height]:
        low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
        x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        inside = np.ones(x.shape, dtype=bool)
        (ax, ay), (bx, by), (cx, cy) = corners
        turn = 1.0 if (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) > 0 else -1.0
        for px, py, qx, qy in ((ax, ay, bx, by), (bx, by, cx, cy), (cx, cy, ax, ay)):
            ex, ey = qx - px, qy - py
            inside &= turn * (ex * (y - py) - ey * (x - px)) >= -0.5 * (abs(ex) + abs(ey))
        mask[low[1] : high[1], low[0] : high[0]] |= inside
    return mask


def test_the_palm_has_fewer_than_3000_triangles() -> None:
    assert 1500 < Obj(RAW / "palm/palm.obj").count < 3000


def test_the_palm_stands_nine_metres_tall_and_leans_out() -> None:
    palm = Obj(RAW / "palm/palm.obj")
    trunk = palm.points[palm.groups == "trunk"].reshape(-1, 3)
    top = trunk[trunk[:, 1].argmax()]
    assert 8.5 < palm.points[..., 1].max() < 9.5
    assert np.abs(trunk[np.abs(trunk[:, 1]) < 0.2][:, [0, 2]]).max() < 0.5  # its foot stands at the origin
    assert top[2] > 3.0


def test_the_jetty_is_25_metres_long_and_its_poles_go_below_the_sea_floor() -> None:
    jetty = Obj(RAW / "jetty/jetty.obj")
    planks = jetty.points[jetty.groups == "planks"].reshape(-1, 3)
    poles = jetty.points[jetty.groups == "poles"].reshape(-1, 3)
    assert 24.5 < np.ptp(planks[:, 2]) < 25.5
    assert 1.9 < np.ptp(planks[:, 0]) < 2.3
    assert poles[:, 1].min() < -6.0
    assert 0.7 < poles[:, 1].max() < 1.1


def test_groups_and_materials_are_named(model: tuple[str, Obj]) -> None:
    name, obj = model
    expected = {
        "palm": {("trunk", "trunk"), ("leaves", "leaves"), ("nuts", "nuts")},
        "jetty": {("planks", "planks"), ("beams", "planks"), ("poles", "poles")},
    }[name]
    assert set(zip(obj.groups.tolist(), obj.materials.tolist(), strict=True)) == expected
    library = (RAW / name / f"{name}.mtl").read_text(encoding="ascii")
    defined = {line.split()[1] for line in library.splitlines() if line.startswith("newmtl")}
    assert defined == {material for _, material in expected}
    for line in library.splitlines():
        if line.startswith("map_"):
            assert (RAW / name / line.split()[1]).is_file(), line


def test_no_face_is_without_area_in_space_or_in_the_atlas(model: tuple[str, Obj]) -> None:
    _, obj = model
    assert areas(obj.points).min() > 1e-8
    assert areas(obj.uvs).min() > 1e-9


def test_normals_are_unit_and_on_the_side_of_their_face(model: tuple[str, Obj]) -> None:
    _, obj = model
    length = np.sqrt((obj.normals**2).sum(axis=2))
    assert np.abs(length - 1.0).max() < 2e-4
    facet = np.cross(obj.points[:, 1] - obj.points[:, 0], obj.points[:, 2] - obj.points[:, 0])
    same_side = (facet[:, None, :] * obj.normals).sum(axis=2) > 0.0
    assert same_side.mean() > 0.99


def test_neighbours_are_wound_alike(model: tuple[str, Obj]) -> None:
    _, obj = model
    _, place = np.unique(np.round(obj.points.reshape(-1, 3) * 1e4), axis=0, return_inverse=True)
    corner = place.reshape(-1, 3)
    edges = np.concatenate([corner[:, [k, (k + 1) % 3]] for k in range(3)])
    _, times = np.unique(edges, axis=0, return_counts=True)
    assert times.max() == 1  # no edge is walked twice the same way


def pieces(count: int, edges: np.ndarray) -> np.ndarray:
    """The connected piece of each of `count` nodes, by the edges (m, 2) between them."""
    ones = np.ones(len(edges))
    graph = coo_matrix((ones, (edges[:, 0], edges[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1])


def volume_with_holes_filled(points: np.ndarray, corner: np.ndarray) -> float:
    """Of one connected part, `corner` (n, 3): negative where it is wound inwards. A fan closes each hole."""
    walked = {(int(t[k]), int(t[(k + 1) % 3])) for t in corner for k in range(3)}
    border = np.array([(b, a) for a, b in walked if (b, a) not in walked], dtype=int).reshape(-1, 2)
    hole = pieces(len(points), border)
    middles = np.array([points[border[hole[border[:, 0]] == hole[a]]].mean(axis=(0, 1)) for a, _ in border])
    fan = np.concatenate([points[border], middles.reshape(-1, 1, 3)], axis=1)
    a, b, c = np.moveaxis(np.concatenate([points[corner], fan]), 1, 0)
    return float((a * np.cross(b, c)).sum() / 6.0)


def test_every_part_but_the_leaves_is_wound_outwards(model: tuple[str, Obj]) -> None:
    _, obj = model
    spots, place = np.unique(np.round(obj.points.reshape(-1, 3) * 1e4), axis=0, return_inverse=True)
    corner = place.reshape(-1, 3)
    part = pieces(len(spots), np.concatenate([corner[:, :2], corner[:, 1:]]))[corner[:, 0]]
    for k in np.unique(part[obj.groups != "leaves"]):
        found = volume_with_holes_filled(spots * 1e-4, corner[part == k])
        assert found > 1e-3, f"{obj.groups[part == k][0]}: {found} cubic metres"


def test_uvs_stay_inside_the_atlas(model: tuple[str, Obj]) -> None:
    _, obj = model
    assert obj.uvs.min() >= 0.0
    assert obj.uvs.max() <= 1.0


@pytest.mark.parametrize("model", sweep(["palm", "jetty"], test=["palm"]), indirect=True)
def test_uv_islands_are_a_gutter_apart(model: tuple[str, Obj], mask: np.ndarray) -> None:
    name, _ = model
    labels, count = ndimage.label(mask, structure=np.ones((3, 3)))
    assert count == ISLANDS[name]
    away, (row, column) = ndimage.distance_transform_edt(labels == 0, return_indices=True)
    nearest = labels[row, column]
    for axis in (0, 1):
        first, second = [(slice(None),) * axis + (part,) for part in (slice(None, -1), slice(1, None))]
        border = nearest[first] != nearest[second]
        assert (away[first] + away[second])[border].min() + 1.0 >= GUTTER_PX


@pytest.mark.parametrize("model", sweep(["palm", "jetty"], test=["palm"]), indirect=True)
def test_gutters_are_painted_so_that_mips_do_not_bleed(model: tuple[str, Obj], mask: np.ndarray) -> None:
    name, _ = model
    pixels = read(RAW / name / {"palm": "palm.ppm", "jetty": "jetty.png"}[name])
    around = ndimage.binary_dilation(mask, iterations=4) & ~mask
    assert pixels[around].max(axis=1).min() > 8.0  # nowhere black
    _, (row, column) = ndimage.distance_transform_edt(~mask, return_indices=True)
    step = np.abs(pixels - pixels[row, column])[around].mean()
    assert step < 24.0  # and much like what lies beside it


def test_the_palms_colours_are_a_binary_ppm() -> None:
    head = (RAW / "palm/palm.ppm").read_bytes()[:32].split()
    assert head[:4] == [b"P6", b"1024", b"1024", b"255"]
    assert (RAW / "palm/palm_alpha.pgm").read_bytes()[:2] == b"P5"


def test_leaf_colour_reaches_beyond_the_leaf() -> None:
    color, alpha = read(RAW / "palm/palm.ppm"), read(RAW / "palm/palm_alpha.pgm")[..., 0]
    solid = alpha > 250
    near = ndimage.binary_dilation(solid, iterations=3) & (alpha < 5)
    assert near.sum() > 10_000
    _, (row, column) = ndimage.distance_transform_edt(~solid, return_indices=True)
    assert np.abs(color - color[row, column])[near].mean() < 25.0


def test_the_jetty_shows_every_pattern_and_never_one_twice_in_a_row(scripts: Any) -> None:
    planks = scripts["jetty"].planks()
    assert 130 < len(planks) < 170
    assert {p.pattern for p in planks} == set(range(scripts["jetty_paint"].PLANKS))
    for a, b in pairwise(planks):
        assert (a.pattern, a.turned, a.mirrored) != (b.pattern, b.turned, b.mirrored)
        assert a.pattern != b.pattern
        assert a.z + a.width / 2 < b.z - b.width / 2  # a gap between them
    obj = Obj(RAW / "jetty/jetty.obj")
    middle = obj.uvs[obj.groups == "poles"].mean(axis=1) * [2048, -1024] + [0, 1024]
    rows = [scripts["jetty_paint"].pole_corner(k)[1] for k in range(4)]
    shown = {k for k, top in enumerate(rows) for x, y in middle if x > 1040 and top <= y <= top + 128}
    assert shown == {0, 1, 2, 3}


@pytest.mark.parametrize("name", sweep(["palm", "jetty"], test=["palm"]))
def test_the_scripts_give_the_same_models_again(scripts: Any, name: str, tmp_path: Path) -> None:
    scripts[name].write_model(tmp_path)
    again = sorted((tmp_path / name).iterdir())
    assert {path.suffix for path in again} == {".obj", ".mtl"}
    for path in again:
        assert path.read_bytes() == (RAW / name / path.name).read_bytes(), f"{path.name} differs"


@pytest.mark.parametrize("piece", sweep(["plank", "end", "pole", "cap"], test=["end", "cap"]))
def test_the_script_paints_the_same_jetty_again(scripts: Any, piece: str) -> None:
    paint = scripts["jetty_paint"]
    x, y = getattr(paint, f"{piece}_center" if piece == "cap" else f"{piece}_corner")(2)
    inset = paint.GUTTER // 2 + (paint.CAP_RADIUS if piece == "cap" else 0)
    image = np.round(getattr(paint, f"paint_{piece}")(2) * 255.0)
    x, y = x - inset, y - inset
    kept = read(RAW / "jetty/jetty.png")[y : y + image.shape[0], x : x + image.shape[1]]
    assert np.abs(image - kept).max() <= 1.0


@pytest.mark.deep
@pytest.mark.parametrize(
    ("script", "folder"),
    [
        ("grove", "grove"),
        ("shells", "shore"),
        ("pebbles", "shore"),
        ("starfish", "shore"),
        ("driftwood", "driftwood"),
        ("animals", "animals"),
    ],
)
def test_the_script_strews_the_same_again(scripts: Any, script: str, folder: str, tmp_path: Path) -> None:
    scripts[script].make(tmp_path)
    # Pictures may differ by a step: test_pictures.py.
    made, kept = (
        {path.name: path.read_bytes() for path in (top / folder).iterdir() if path.suffix != ".png"}
        for top in (tmp_path, RAW)
    )
    if folder == "shore":  # three scripts write there
        kept = {name: data for name, data in kept.items() if name.startswith(script.removesuffix("s"))}
    assert made == kept


def test_the_script_builds_the_same_starfish_again_and_it_lies_flat(scripts: Any, tmp_path: Path) -> None:
    scripts["starfish"].write_starfish(tmp_path)
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (RAW / "shore" / path.name).read_bytes(), f"{path.name} differs"
    words = [line.split() for line in (RAW / "shore/starfish.obj").read_text().splitlines()]
    points = np.array([row[1:4] for row in words if row[0] == "v"], dtype=float)
    faces = np.array([[int(c.split("/")[0]) - 1 for c in row[1:]] for row in words if row[0] == "f"])
    assert len(faces) < 500
    corners = points[faces]
    facet = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (facet[:, 1] > -1e-6).all()  # nothing looks down


def test_starfish_lie_under_water(scripts: Any) -> None:
    """Their middle is not above the sea, not even between waves."""
    rows = (RAW / "shore/starfish.csv").read_text().splitlines()[1:]
    places = np.array([[float(v) for v in row.split(",")] for row in rows])
    assert len(places) >= 10
    assert (places[:, 1] + 0.2 * places[:, 4] < -0.05).all()


# The lamps ask for the ground's height, which takes ten seconds.
@pytest.mark.parametrize("name", sweep(["bar", "boat", "lamps"], test=["boat"]))
def test_the_script_builds_the_same_bar_boat_and_lamps_again(scripts: Any, name: str, tmp_path: Path) -> None:
    scripts[name].make(tmp_path)
    made, kept = (sorted((top / name).iterdir()) for top in (tmp_path, RAW))
    assert [path.name for path in made] == [path.name for path in kept]
    for again, path in zip(made, kept, strict=True):
        if path.suffix == ".png":
            assert np.abs(read(again) - read(path)).max() <= 1.0
        else:
            assert again.read_bytes() == path.read_bytes(), f"{path.name} differs"


def test_the_script_builds_the_same_post_and_lantern_again(scripts: Any, tmp_path: Path) -> None:
    note = "Lamps, made by raw_assets/make/lamps.py; metres, Y up"
    for name in ("post", "lantern"):
        getattr(scripts["lamps"], name)().write(tmp_path / f"{name}.obj", "lamps.mtl", note)
        assert (tmp_path / f"{name}.obj").read_bytes() == (RAW / f"lamps/{name}.obj").read_bytes()


def test_the_bar_has_few_triangles_and_its_roof_keeps_out_the_rain() -> None:
    bar = Obj(RAW / "bar/bar.obj")
    assert bar.count < 4000
    roof = bar.points[bar.materials == "thatch"]
    facet = np.cross(roof[:, 1] - roof[:, 0], roof[:, 2] - roof[:, 0])
    assert (facet[:, 1] > 0.0).mean() > 0.98  # the leaves look up
    for x, z in ((0.3, 0.4), (-1.9, 1.1), (2.2, -1.2), (2.4, 1.5)):
        a, b, c = (roof[:, k][:, [0, 2]] - [x, z] for k in range(3))
        turns = [p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((a, b), (b, c), (c, a))]
        over = np.all([turn <= 0.0 for turn in turns], axis=0) | np.all(
            [turn >= 0.0 for turn in turns], axis=0
        )
        assert over.sum() >= 2, f"{over.sum()} courses of leaves over {x}, {z}"


@pytest.mark.parametrize(
    "model",
    [
        "rocks/boulder",
        "rocks/slab",
        "driftwood/log",
        "driftwood/branch",
        "bar/bar",
        "bar/things",
        "boat/boat",
        "lamps/post",
        "lamps/lantern",
    ],
)
def test_models_of_one_skin_are_wound_outwards(model: str) -> None:
    mesh = read_model(RAW / f"{model}.obj").mesh
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles].astype(np.float64), 1, 0)
    volume = (a * np.cross(b, c)).sum() / 6.0
    box = np.ptp(mesh.positions, axis=0).prod()
    assert 0.0 < volume < box
    assert volume > 0.3 * box or not model.startswith("rocks")


def test_the_light_of_a_lamp_is_in_its_lantern_and_no_lamp_stands_in_the_cameras_way(scripts: Any) -> None:
    scene = load_scene(RAW / "island.toml")
    (light,) = [light for light in scene.lights if light.object == "lamp"]
    assert light.offset == scripts["lamps"].LANTERN
    post = read_model(RAW / "lamps/post.obj").mesh
    (group,) = [group for group in post.groups if group.material == "flame"]
    flame = post.positions[post.triangles[group.first : group.first + group.count]].reshape(-1, 3)
    assert np.abs(0.5 * (flame.min(axis=0) + flame.max(axis=0)) - light.offset).max() < 0.02
    flight = plan_flight(scene.flight)
    eyes = np.array([flight.pose(0.25 * k)[0] for k in range(960)])
    lamps = next(item for item in scene.objects if item.name == "lamp")
    for instance in lamps.instances:
        away = eyes[:, (0, 2)] - np.array(instance.position)[[0, 2]]
        assert np.hypot(away[:, 0], away[:, 1]).min() > 0.7


@pytest.mark.deep
def test_the_script_makes_the_same_rocks_again(scripts: Any, tmp_path: Path) -> None:
    scripts["rocks"].make(tmp_path)
    made, kept = (sorted((top / "rocks").iterdir()) for top in (tmp_path, RAW))
    assert [path.name for path in made] == [path.name for path in kept]
    for again, path in zip(made, kept, strict=True):
        if path.suffix == ".png":
            assert np.abs(read(again) - read(path)).max() <= 1.0
        else:
            assert again.read_bytes() == path.read_bytes(), f"{path.name} differs"


@pytest.mark.deep
def test_the_script_paints_the_same_palm_again(scripts: Any) -> None:
    color, alpha = scripts["palm_paint"].atlas()
    assert np.abs(np.round(color * 255.0) - read(RAW / "palm/palm.ppm")).max() <= 1.0
    assert np.abs(np.round(alpha * 255.0) - read(RAW / "palm/palm_alpha.pgm")[..., 0]).max() <= 1.0
