"""Promises of whole bakes of pictures: memory, threads, budgets, and pictures of every kind."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from paradize.bakers.color import bake_color
from paradize.bakers.maps.bake import bake_maps, unit_of_heights
from paradize.bakers.maps.textures import within_reach
from paradize.bakers.product import MapProduct
from paradize.build.bake import bake
from paradize.build.options import BuildOptions
from paradize.data import Texture
from paradize.errors import BakeError
from paradize.formats.ktx2.reader import decode_ktx2
from paradize.metrics.texels import decode_texels, rebuilt
from paradize.scene.settings import FILTERS
from tests.pipeline.heights import angles_between, rounded, save, sinusoids, up, waves
from tests.pipeline.scenes import make_cove, write_image
from tests.places import PEAK
from tests.sweeps import CORPUS_DEEP, sweep

MEMORY = (
    PEAK
    + """
import sys
from pathlib import Path
import paradize.kernels.bc7, paradize.metrics.levels
from paradize.bakers.maps.bake import bake_maps
before = peak() // 1024
uv = Path(sys.argv[3]) if len(sys.argv) > 3 else None
bake_maps(Path(sys.argv[1]), source="height", wrap="repeat", fmt=sys.argv[2], uv=uv)
print(peak() // 1024 - before)
"""
)


def peak_bytes(path: Path, *more: str) -> int:
    """The peak of memory that a bake of the four maps of a height map adds to its process's memory at most.
    more: the format (KTX2 by itself), and an OBJ with a UV layout."""
    environment = {**os.environ, "PARADIZE_THREADS": "2"}
    command = [sys.executable, "-c", MEMORY, str(path), *(more or ("ktx2",))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=550, env=environment)
    assert done.returncode == 0, done.stderr
    return int(done.stdout) * 1024


def height_map(path: Path, size: int) -> Path:
    """A 16-bit height map of tiles of waves."""
    tile = (waves(512, 512, 5) * 5000 + 32768).clip(0, 65535).astype(np.uint16)
    spec = oiio.ImageSpec(size, size, 1, oiio.UINT16)
    spec.attribute("png:compressionLevel", 1)
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    for y in range(size):
        row = np.tile(tile[y % 512], size // 512).reshape(size, 1)
        assert target.write_scanline(y, 0, np.ascontiguousarray(row))
    assert target.close()
    return path


@pytest.mark.deep
@pytest.mark.parametrize("size", [3072, 4096])
def test_four_maps_need_at_most_six_times_their_heights_in_memory(tmp_path: Path, size: int) -> None:
    assert peak_bytes(height_map(tmp_path / "h.png", size)) <= 6 * 4 * size * size


def test_normals_of_a_tinted_grey_are_as_smooth_as_those_of_the_grey(tmp_path: Path) -> None:
    field = sinusoids(256, 32, 128, 4)[0]
    grey = 40 + 180 * (field - field.min()) / np.ptp(field)
    rough = {}
    for name, tint in (("grey", (1.0, 1.0, 1.0)), ("warm", (1.0, 0.95, 0.85))):
        path = save(tmp_path / f"{name}.png", np.rint(grey[:, :, None] * tint).astype(np.uint8))
        made = bake_maps(path, only=("normal",), source="color", wrap="repeat", strength=30.0)
        shown = rebuilt(decode_texels(decode_ktx2(made["normal"].data)))
        rough[name] = float(angles_between(shown[1:], shown[:-1]).mean())
    assert rough["warm"] < 1.2 * rough["grey"]


def tiles(path: Path, count: int) -> Path:
    """An OBJ whose UV islands are count x count squares with gaps between them."""
    lines, size = [], 0.7 / count
    for k in range(count * count):
        x, y = ((k % count) + 0.15) / count, (k // count + 0.15) / count
        for u, v in ((x, y), (x + size, y), (x + size, y + size), (x, y + size)):
            lines += [f"v {u} {v} 0", f"vt {u} {v}"]
        lines.append("f " + " ".join(f"{4 * k + i}/{4 * k + i}" for i in range(1, 5)))
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(
    ("size", "fmt", "times"),
    sweep(
        [(1024, "ktx2", 12), (2048, "ktx2", 8), (4096, "ktx2", 6), (4096, "png", 6)],
        test=[(1024, "ktx2", 12)],
    ),
)
def test_maps_with_a_uv_layout_need_at_most_so_many_times_their_heights(
    tmp_path: Path, size: int, fmt: str, times: int
) -> None:
    """Memory that does not grow with the picture counts for more in the small ones."""
    uv = tiles(tmp_path / "uv.obj", 8)
    assert peak_bytes(height_map(tmp_path / "h.png", size), fmt, str(uv)) <= times * 4 * size * size


@pytest.mark.deep
def test_large_height_maps_need_at_most_six_times_their_heights_too(tmp_path: Path) -> None:
    size = 8192
    assert peak_bytes(height_map(tmp_path / "h.png", size)) <= 6 * 4 * size * size


@pytest.mark.deep
def test_16384_texels_a_side_are_baked_in_less_than_8_gigabytes(tmp_path: Path) -> None:
    assert peak_bytes(height_map(tmp_path / "h.png", 16384)) < 8e9


@pytest.mark.parametrize("scale", sweep([1, 4], test=[1]))
def test_bytes_and_errors_are_the_same_with_any_number_of_threads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scale: int
) -> None:
    rng = np.random.default_rng(3)
    color = save(tmp_path / "c.png", rng.integers(0, 256, (65 * scale, 259 * scale, 4), dtype=np.uint8))
    heights = (waves(128 * scale, 96 * scale, 7) * 6000 + 30000).clip(0, 65535).astype(np.uint16)
    height = save(tmp_path / "h.png", heights[:, :, None], oiio.UINT16)
    found = []
    for threads in ("1", "2", "5"):
        monkeypatch.setenv("PARADIZE_THREADS", threads)
        made = [
            *bake_maps(color, strength=5.0).values(),
            *bake_maps(height, source="height", wrap="repeat", tier="exact").values(),
            bake_color(color),
            bake_color(color, tier="exact"),
        ]
        found.append([(product.data, product.levels) for product in made])
    assert found[0] == found[1] == found[2]


# Budgets


@pytest.fixture
def rough(tmp_path: Path) -> Path:
    """Heights and colours that blocks cannot hold."""
    codes = np.random.default_rng(8).integers(0, 256, (32, 32, 3), dtype=np.uint8)
    return save(tmp_path / "rough.png", codes)


def test_a_budget_that_blocks_exceed_takes_the_next_format_and_says_why(rough: Path) -> None:
    plain = bake_maps(rough, strength=30.0)
    ladder = {"normal": "RG8_SNORM", "height": "R8_UNORM", "gloss": "RG8_UNORM"}
    exact = {"normal": "RG16_SNORM", "height": "R16_UNORM", "gloss": "RG16_UNORM"}
    for name, second in ladder.items():
        metric = str(plain[name].metric)
        less = metric.endswith("_db")
        assert plain[name].reason is None
        middle = bake_maps(rough, strength=30.0, only=[name], budget={metric: 52.0 if less else 2.5})[name]
        assert (middle.format, middle.error) == (second, middle.errors[metric])
        assert middle.error > 52.0 if less else middle.error <= 2.5
        assert str(middle.reason).startswith(f"{plain[name].format} exceeds the budget: {metric}")
        last = bake_maps(rough, strength=30.0, only=[name], budget={metric: 80.0 if less else 0.02})[name]
        assert last.format == exact[name]
        assert last.error > 80.0 if less else last.error <= 0.02
        assert decode_ktx2(last.data).format == exact[name]
    # a budget that nothing meets ends at the most exact format
    assert bake_maps(rough, only=["height"], budget={"height_psnr_db": 999.0})["height"].format == "R16_UNORM"


def test_no_larger_format_is_taken_for_what_the_slope_filter_costs(tmp_path: Path) -> None:
    """Central differences of short waves: no format betters them."""
    v, u = np.mgrid[0:64, 0:64]
    heights = 0.5 + 0.2 * np.sin(2.0 * np.pi * (u + 0.3 * v) / 6.0) + 0.2 * np.cos(2.0 * np.pi * v / 5.0)
    picture = save(tmp_path / "waves.exr", heights.astype(np.float32)[:, :, None])

    def normal(**budget: float) -> MapProduct:
        made = bake_maps(
            picture, only=["normal"], source="height", strength=8.0, filter="central", budget=budget
        )
        return made["normal"]

    plain = normal()
    assert plain.format == "BC5_SNORM"
    for filtered, whole in (("_filter_p99", "_p99"), ("_filter", "_mean"), ("_filter_max", "_max")):
        part, error = plain.errors[f"normal{filtered}_deg"], plain.errors[f"normal{whole}_deg"]
        assert part > 1.0
        held = normal(**{f"normal{whole}_deg": 0.9 * part})
        assert (held.format, held.reason) == ("BC5_SNORM", None)
        if error > 1.001 * part:  # here a format can help
            met = normal(**{f"normal{whole}_deg": 0.5 * (part + error)})
            assert met.format != "BC5_SNORM" and met.errors[f"normal{whole}_deg"] < error
        assert normal(**{f"normal{filtered}_deg": 0.9 * part}).data == plain.data


def test_a_limit_that_the_filter_just_keeps_is_within_reach_and_none_of_the_filters_own() -> None:
    filtered = {"normal_filter_deg": 3.0, "normal_filter_p99_deg": 2.0, "normal_filter_max_deg": 9.0}
    budget = {"normal_mean_deg": 2.9, "normal_p99_deg": 2.0, "normal_max_deg": 9.5, "normal_filter_deg": 5.0}
    assert within_reach(budget, filtered) == {"normal_p99_deg": 2.0, "normal_max_deg": 9.5}


def test_colour_goes_to_bc7_and_then_to_plain_texels(tmp_path: Path) -> None:
    codes = np.random.default_rng(8).integers(0, 256, (36, 36, 3), dtype=np.uint8)
    rough = save(tmp_path / "rough.png", codes)
    plain = bake_color(rough)
    assert (plain.format, plain.reason) == ("BC1_RGB_SRGB", None)
    better = bake_color(rough, budget={"color_psnr_db": plain.error + 1.0})
    assert better.format == "BC7_SRGB"
    assert better.error > plain.error + 1.0
    exact = bake_color(rough, budget={"color_psnr_db": 100.0})
    assert (exact.format, exact.error) == ("RGBA8_SRGB", 120.0)
    assert str(exact.reason).startswith("BC7_SRGB exceeds the budget: color_psnr_db")


def test_a_budget_that_blocks_meet_changes_no_byte(rough: Path) -> None:
    budget = {"normal_p99_deg": 90.0, "height_psnr_db": 1.0, "gloss_psnr_db": 1.0}
    plain, met = bake_maps(rough), bake_maps(rough, budget=budget)
    assert {name: product.data for name, product in plain.items()} == {
        name: product.data for name, product in met.items()
    }


def test_a_scenes_budget_decides_formats_is_part_of_the_key_and_the_reason_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cove_store: Callable[[Path], Path]
) -> None:
    monkeypatch.setenv("PARADIZE_STORE", str(cove_store(tmp_path / "store")))
    scene = make_cove(tmp_path / "scene")
    text = scene.read_text()
    rows = []
    for budget in ("", "color_psnr_db = 100.0\nheight_psnr_db = 75.0\n"):
        scene.write_text(text + ("\n[budget]\n" + budget if budget else ""))
        report = bake(scene, tmp_path / "out", BuildOptions(jobs=1))
        assert not report.errors, report.errors
        rows.append({row["name"]: row for row in report.rows})
    blocks, uncompressed = rows
    assert blocks["post_color"]["format"] == "BC1_RGB_SRGB"
    assert (blocks["post_color"]["reason"], blocks["post_color"]["status"]) == (None, "reused")
    assert uncompressed["post_color"]["format"] == "RGBA8_SRGB"
    assert "exceeds the budget: color_psnr_db" in uncompressed["post_color"]["reason"]
    assert uncompressed["post_color"]["status"] == uncompressed["post_height"]["status"] == "baked"
    assert uncompressed["post_height"]["format"] == "R16_UNORM"
    assert uncompressed["water_normal"]["status"] == uncompressed["terrain_mesh"]["status"] == "reused"
    scene_json = json.loads((tmp_path / "out/scene.json").read_text())
    levels = scene_json["artifacts"]["post_color"]["levels"]
    assert levels == uncompressed["post_color"]["levels"]
    assert levels[0]["psnr_db"] == uncompressed["post_color"]["errors"]["color_psnr_db"]


# Options


def test_a_named_filter_is_used_and_told(rough: Path) -> None:
    for name in FILTERS[1:]:
        assert bake_maps(rough, only=["normal"], filter=name)["normal"].filter == name
    with pytest.raises(BakeError, match="filter"):
        bake_maps(rough, only=["normal"], filter="sobel")


def test_de_stepped_heights_stay_within_half_a_step_of_the_source(tmp_path: Path) -> None:
    codes = (np.arange(128)[None, :] // 8 + np.zeros((16, 1))).astype(np.uint8)[:, :, None] + 60
    path = save(tmp_path / "ramp.png", codes)
    plain = bake_maps(path, source="height", only=["height", "normal"], filter="central", strength=500)
    smooth = bake_maps(
        path, source="height", only=["height", "normal"], filter="central", strength=500, destep=True,
        budget={"height_psnr_db": 90.0},
    )  # fmt: skip
    heights = decode_texels(decode_ktx2(smooth["height"].data))[:, :, 0]
    assert np.abs(heights - codes[:, :, 0] / 255).max() <= 0.5 / 255 + 1 / 65535
    slopes = [decode_texels(decode_ktx2(made["normal"].data))[8, 16:112, 0] for made in (plain, smooth)]
    assert np.ptp(slopes[1]) < 0.2 * np.ptp(slopes[0])  # a ramp instead of stairs


def test_de_stepping_keeps_the_filter_that_the_steps_ask_for(tmp_path: Path) -> None:
    heights, dx, dy = sinusoids(256, 64, 128, 3)
    unit, span = rounded(heights, 8)
    path = save(tmp_path / "h.png", np.rint(unit * 255).astype(np.uint8)[:, :, None])
    settings = {"source": "height", "wrap": "repeat", "only": ["normal"], "slope_scale": span}
    plain, smooth = (bake_maps(path, destep=destep, **settings)["normal"] for destep in (False, True))
    assert plain.filter == smooth.filter
    truth = up(dx, dy)
    off = [
        angles_between(rebuilt(decode_texels(decode_ktx2(made.data))), truth).mean()
        for made in (plain, smooth)
    ]
    assert off[1] < off[0]


def test_de_stepping_of_a_file_without_steps_changes_nothing_and_says_so(tmp_path: Path) -> None:
    codes = (waves(64, 64, 5) * 3000 + 32768).astype(np.uint16)[:, :, None]
    path = save(tmp_path / "h.png", codes, oiio.UINT16)
    plain, destepped = (
        bake_maps(path, source="height", only=["normal"], destep=destep)["normal"] for destep in (False, True)
    )
    assert (destepped.data, destepped.filter) == (plain.data, plain.filter)
    assert any("no steps" in warning for warning in destepped.warnings)


def test_levels_shape_the_heights_that_normals_and_gloss_come_from(rough: Path) -> None:
    plain = bake_maps(rough, only=["height", "normal"], budget={"height_psnr_db": 80.0})
    upside = bake_maps(rough, only=["height", "normal"], invert=True, budget={"height_psnr_db": 80.0})
    pair = [decode_texels(decode_ktx2(made["height"].data)) for made in (plain, upside)]
    assert np.abs(pair[0] + pair[1] - 1).max() < 1e-4
    slopes = [decode_texels(decode_ktx2(made["normal"].data)) for made in (plain, upside)]
    assert np.abs(slopes[0] + slopes[1]).max() < 0.05


def test_zstd_shrinks_the_file_and_keeps_the_texels(tmp_path: Path) -> None:
    path = save(tmp_path / "flat.png", np.full((256, 256, 3), 90, np.uint8))
    for make in (bake_color, lambda p, **more: bake_maps(p, only=["normal"], **more)["normal"]):
        plain, packed = make(path), make(path, zstd=10)
        assert len(packed.data) < len(plain.data) / 4
        assert decode_ktx2(packed.data).levels == decode_ktx2(plain.data).levels


def test_the_command_line_takes_every_option_and_tells_filter_and_levels(
    rough: Path, tmp_path: Path, paradize_here: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    options = ["--filter", "scharr", "--destep", "--gamma", "1.2", "--contrast", "0.9", "--brightness", "0.1"]
    more = ["--black", "0.1", "--white", "0.8", "--invert", "--zstd", "--json"]
    done = paradize_here("maps", rough, "-o", tmp_path / "out", *options, *more)
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)["maps"]
    assert report["normal"]["filter"] == "scharr"
    assert len(report["normal"]["levels"]) == 6
    assert set(report["normal"]["levels"][5]) == {"mean_deg", "p99_deg", "max_deg"}
    assert report["height"]["errors"]["height_max"] > 0
    for wrong in (["--filter", "sobel"], ["--gamma", "0"], ["--zstd", "23"]):
        assert paradize_here("maps", rough, "-o", tmp_path / "no", *wrong).returncode == 2
    same = paradize_here("maps", rough, "-o", tmp_path / "no", "--black", "1")
    assert same.returncode == 1
    assert "black" in same.stderr


@pytest.mark.parametrize(
    ("low", "high", "unit"), [(0.5, 0.5, (0, 1)), (7, 7, (7, 1)), (0, 1, (0, 1)), (-1, 3, (-1, 4))]
)
def test_heights_that_are_all_one_are_told_and_others_fill_their_map(
    low: float, high: float, unit: tuple[float, float]
) -> None:
    heights = np.array([[low, high]], np.float32)
    found, warnings = unit_of_heights(heights, Path("h.png"))
    assert found == unit
    flat = f"h.png: every height is {low:g}, so its maps are flat; give the picture that holds the heights"
    assert (warnings == [flat]) == (low == high) and len(warnings) == (low == high or low < 0)


# Pictures of every kind, made here and of others

WHOLE = """
import resource, signal, sys
from pathlib import Path
from paradize.bakers.color import bake_color
from paradize.bakers.maps.bake import bake_maps
from paradize.errors import ParadizeError
resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
for name in sys.stdin.read().splitlines():
    print(name, file=sys.stderr, flush=True)
    signal.setitimer(signal.ITIMER_PROF, 120.0)  # of processor time, on two threads: then this ends
    try:
        made = [*bake_maps(Path(name)).values(), bake_color(Path(name))]
        assert all(product.levels for product in made)
    except ParadizeError as error:
        assert name in str(error), str(error)
        print("refused", name)
    else:
        print("baked", name)
"""


def bake_all(files: list[Path]) -> dict[str, list[str]]:
    """Bakes maps and colour of each file in one process, within 8 GiB; their names by what came of them."""
    done = subprocess.run(
        [sys.executable, "-c", WHOLE],
        input="\n".join(map(str, files)),
        capture_output=True,
        text=True,
        timeout=1500,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    lines = [line.split(" ", 1) for line in done.stdout.splitlines()]
    assert len(lines) == len(files)
    return {word: [name for kind, name in lines if kind == word] for word in ("baked", "refused")}


def pictures(sources: Path) -> list[Path]:
    folders = ("images", "textures", "water", "sky", "height")
    kinds = {".json", ".asc", ".md", ".txt", ""}
    found = (path for folder in folders for path in sorted((sources / folder).rglob("*")) if path.is_file())
    return [path for path in found if path.suffix.lower() not in kinds]


@CORPUS_DEEP
def test_a_sample_of_pictures_is_baked_or_refused_with_a_message(sources: Path) -> None:
    small = [path for path in pictures(sources) if path.stat().st_size < 60_000]
    found = bake_all(small[:: max(1, len(small) // 16)])
    assert len(found["baked"]) > 3 * len(found["refused"])


@pytest.mark.deep
def test_every_picture_is_baked_or_refused_with_a_message(sources: Path) -> None:
    found = bake_all(pictures(sources))
    assert len(found["baked"]) > 8 * len(found["refused"]), found["refused"]


def test_a_texture_whose_levels_are_not_measured_has_no_errors(rough: Path) -> None:
    for product in (bake_color(rough, measure=False), *bake_maps(rough, measure=False).values()):
        assert (product.errors, product.levels, product.metric) == ({}, [], None)
        texture = decode_ktx2(product.data)
        assert isinstance(texture, Texture)


def test_sides_that_keep_a_large_picture_from_blocks_are_told(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    for columns, rows, told in ((160, 158, True), (160, 160, False), (30, 30, False)):
        picture = tmp_path / f"{columns}x{rows}.png"
        write_image(picture, rng.integers(0, 256, (rows, columns, 3), np.uint8))
        said = f"{picture}: {columns} x {rows} texels: block formats need sides that divide by 4"
        mend = "160 x 160 would do"
        warnings = bake_color(picture, measure=False).warnings
        assert [text for text in warnings if text.startswith(said) and text.endswith(mend)] == warnings[:told]
        normal = bake_maps(picture, measure=False)["normal"].warnings
        assert any(text.startswith(said) for text in normal) == told


def test_a_picture_whose_name_says_that_it_is_no_colour_map_is_told_where_it_is_guessed(
    tmp_path: Path,
) -> None:
    said = {
        "bricks_disp": "says 'disp', and it is taken for colour; if the name is right, add --from height",
        "rock_Height_4K": "says 'height'",
        "RIM_ROUGHNESS": "says 'roughness', and it is taken for colour; if the name is right, give the",
        "Duck_Metallic.png": "says 'metallic'",
        "gold-normalOGL": "says 'normal'",
        "wall_AO": "its name says 'ao'",
        "wall_luma": "says 'luma'",
        "T_Wall_MRAO": "says 'mrao'",
        "Rock_Emission": "says 'emission'",
        "lamp_emissive": "says 'emissive'",
        "ground_nrm_rgh": "says 'rgh'",
        "wall_cavity": "says 'cavity'",
        "Wall_Curvature_2k": "says 'curvature'",
        "leaf_Opacity": "says 'opacity'",
        "Normal/rock": "its folder's name says 'normal'",
    }
    grey = np.full((8, 8, 1), 90, np.uint8)
    for name in (
        *said,
        "rough_wall",
        "normal_stone_diffuse",
        "map",
        "4k",
        "Normal/wood_Color",
        "glossy heights/a",
    ):
        path = tmp_path / f"{name}.png"
        path.parent.mkdir(exist_ok=True)
        write_image(path, grey)
        told = [
            [
                text
                for text in bake_maps(path, source=source, only=["height"])["height"].warnings
                if "says" in text
            ]
            for source in ("auto", "color")
        ]
        assert [len(texts) for texts in told] == [int(name in said), 0], (name, told)
        assert name not in said or said[name] in told[0][0]


def test_heights_that_are_guessed_of_a_picture_whose_name_says_otherwise_are_told(tmp_path: Path) -> None:
    said = {
        "rock_rough_1k": "says 'rough', and it is taken for heights; if the name is right, give the colour",
        "Rock_Color": "says 'color', and it is taken for heights; if the name is right, add --from c",
        "AO/rock": "its folder's name says 'ao', and it is taken for heights",
    }
    for name in (*said, "rock_disp_4k", "rock"):
        path = tmp_path / f"{name}.png"
        path.parent.mkdir(exist_ok=True)
        write_image(path, np.full((8, 8, 1), 9000, np.uint16))
        for source, told in (("auto", name in said), ("height", False)):
            warnings = bake_maps(path, source=source, only=["height"])["height"].warnings
            texts = [text for text in warnings if "says" in text]
            assert len(texts) == told and (not told or said[name] in texts[0]), (name, texts)
