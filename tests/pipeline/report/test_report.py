"""Contact sheets: drawn from what was baked, anew only where something changed, and told when they fail."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from paradize.build.provenance import BakeReport
from paradize.cli.main import main
from paradize.data import Group, Lod, Mesh, Texture
from paradize.formats.glb.encode import encode_glb
from paradize.formats.ktx2.encode import encode_ktx2
from paradize.formats.ktx2.layout import full_level_count
from paradize.preview.pictures import MaterialDefaults, SheetMap, lit_preview
from paradize.preview.shade import Material, flat_preview, sphere_preview, to_light, to_srgb
from paradize.report import lod_view, sheet
from paradize.report.folder import draw_folder, draw_maps, draw_page
from paradize.report.levels import draw_object
from paradize.report.poster import FILE, Poster, draw_poster
from paradize.report.scene_page import _curves, scene_page
from paradize.report.sheet import draw_sheet, error_lines
from paradize.report.verdict import SWITCHED, verdict_of
from paradize.scene.budget import METRICS, REPORTED, meaning_of
from tests.conftest import RENDER_ENVIRONMENT
from tests.pipeline.scenes import make_cove
from tests.pipeline.shapes import soup
from tests.pipeline.small_scenes import sky_and_sound
from tests.sweeps import sample

F32 = npt.NDArray[np.float32]
NO_POSTER = Poster(None, "")


@pytest.fixture(autouse=True)
def _small_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Previews and levels of a quarter and half as many pixels a side, which are most of a sheet's time.
    tests/e2e/test_golden.py draws a sheet as a user gets it."""
    monkeypatch.setattr(sheet, "PREVIEW", 160)
    monkeypatch.setattr(lod_view, "SIZE", 180)
    monkeypatch.setattr(lod_view, "_FINE", 360)


def chain(fmt: str, texels: npt.NDArray[Any]) -> Texture:
    """A texture whose mips take every second texel."""
    height, width = texels.shape[:2]
    levels = []
    for level in range(full_level_count(width, height)):
        rows, columns = max(1, height >> level), max(1, width >> level)
        step = texels[:: max(1, height // rows), :: max(1, width // columns)][:rows, :columns]
        levels.append(np.ascontiguousarray(step).tobytes())
    return Texture(fmt, width, height, tuple(levels))


def plain(color: tuple[int, int, int, int], size: int = 16) -> Texture:
    return chain("RGBA8_SRGB", np.full((size, size, 4), color, np.uint8))


def entry(texture: Texture, **errors: float) -> SheetMap:
    return SheetMap(texture, sum(map(len, texture.levels)), "balanced", errors)


def scene_folder(folder: Path, **textures: Texture) -> Path:
    """A folder with a scene.json of nothing but artifacts."""
    folder.mkdir(exist_ok=True)
    artifacts = {}
    for name, texture in textures.items():
        data = encode_ktx2(texture)
        (folder / f"{name}.ktx2").write_bytes(data)
        artifacts[name] = {
            "file": f"{name}.ktx2", "kind": "cubemap" if texture.faces == 6 else "texture", "tier": "exact",
            "sha256": str(hash(data)), "bytes": len(data), "errors": {"color_psnr_db": 40.0},
        }  # fmt: skip
    result = {"name": "test", "exposure": 1.0, "artifacts": artifacts, "objects": []}
    (folder / "scene.json").write_text(json.dumps(result))
    return folder


def test_the_preview_lights_a_slope_that_faces_the_light_brighter_than_one_that_turns_away() -> None:
    towards = np.array([-0.5, 0.5, np.sqrt(0.5)], np.float32).reshape(1, 1, 3)
    away = towards * np.array([-1, -1, 1], np.float32)
    grey = np.full((1, 1, 3), 0.5, np.float32)
    bright = flat_preview(Material(color=grey, normal=towards), 8, 8)
    flat = flat_preview(Material(color=grey), 8, 8)
    dark = flat_preview(Material(color=grey, normal=away), 8, 8)
    assert bright.min() > flat.max() > flat.min() > dark.max()


def test_a_shape_is_lit_from_the_upper_left_and_stands_before_the_paper() -> None:
    seen = sphere_preview(Material(), 64).astype(int).sum(axis=2)
    assert seen[20, 20] > seen[32, 32] > seen[44, 44]
    assert (seen[0, 0], seen[63, 63]) == (24 + 25 + 28, 24 + 25 + 28)


def test_gloss_shines_and_smoothness_narrows_the_shine() -> None:
    def spread(specular: float, smoothness: float) -> tuple[int, int]:
        material = Material(base=(0.1, 0.1, 0.1), base_specular=specular, base_smoothness=smoothness)
        seen = sphere_preview(material, 128).max(axis=2)
        return int(seen.max()), int((seen > 150).sum())

    dull, rough, smooth = spread(0.0, 0.5), spread(1.0, 0.6), spread(1.0, 0.9)
    assert dull[0] < rough[0] <= smooth[0] == 255
    assert 0 < smooth[1] < rough[1] * 3


def test_srgb_goes_to_light_and_back() -> None:
    codes = np.arange(256, dtype=np.uint8)
    grey = np.repeat(codes[:, None], 3, axis=1)
    assert np.array_equal(to_srgb(to_light(grey.astype(np.float32) / np.float32(255))), grey)


def test_holes_show_the_ground_behind_them() -> None:
    opaque = lit_preview({"color": entry(plain((200, 40, 40, 255)))}, MaterialDefaults(), 32)
    hollow = lit_preview({"color": entry(plain((200, 40, 40, 0)))}, MaterialDefaults(), 32)
    assert opaque[..., 0].min() > 150
    assert hollow.max() < 90
    assert np.ptp(hollow.astype(int)) > 0  # chequered


def test_the_preview_keeps_the_map_s_shape() -> None:
    wide = chain("RGBA8_SRGB", np.full((8, 32, 4), 128, np.uint8))
    assert lit_preview({"color": entry(wide)}, MaterialDefaults(), 64).shape == (16, 64, 3)


def test_a_preview_of_the_map_s_size_shows_each_texel_where_it_lies() -> None:
    texels = np.random.default_rng(2).random((3, 4, 3)).astype(np.float32)
    seen = flat_preview(Material(color=texels), 4, 3)
    for row, column in np.ndindex(3, 4):
        alone = flat_preview(Material(base=tuple(texels[row, column].tolist())), 1, 1)
        assert np.array_equal(seen[row, column], alone[0, 0]), (row, column)


@pytest.mark.parametrize(("height", "width"), sample([(1, 1), (64, 64), (1, 9), (130, 3)], every=4))
def test_a_sheet_is_drawn_of_maps_of_any_shape(height: int, width: int) -> None:
    rng = np.random.default_rng(1)

    def noise(channels: int, kind: type[np.generic]) -> npt.NDArray[Any]:
        return rng.integers(0, 120, (height, width, channels)).astype(kind)

    maps = {
        "color": entry(chain("RGBA8_SRGB", noise(4, np.uint8)), color_psnr_db=41.5),
        "height": entry(chain("R8_UNORM", noise(1, np.uint8))),
        "normal": entry(chain("RG8_SNORM", noise(2, np.int8)), normal_p99_deg=1.25),
        "gloss": entry(chain("RG8_UNORM", noise(2, np.uint8))),
        "dudv": entry(chain("RG8_SNORM", noise(2, np.int8))),
    }
    for tiles in (False, True):
        png = draw_sheet("bark", "of a test", maps, MaterialDefaults(tiles))
        assert png[:8] == b"\x89PNG\r\n\x1a\n"


def test_a_sheet_s_errors_have_their_units_and_every_level() -> None:
    levels = [{"mean_deg": 0.1, "p99_deg": 1.94}, {"mean_deg": 0.2, "p99_deg": 2.5}]
    texture = chain("RG8_SNORM", np.zeros((2, 2, 2), np.int8))
    lines = error_lines("normal", SheetMap(texture, 10, "exact", {"normal_p99_deg": 1.94}, levels))
    assert lines == ["p99 1.94°", "p99 by level, °: 1.94 2.50"]
    assert error_lines("color", entry(plain((0, 0, 0, 255)), color_psnr_db=41.5)) == ["psnr 41.5 dB"]
    assert error_lines("color", entry(plain((0, 0, 0, 255)))) == ["no error was measured"]


def test_only_what_changed_is_drawn_anew(tmp_path: Path) -> None:
    sheets = tmp_path / "report"
    sky = Texture("RGBA16F", 4, 4, tuple(bytes(8 * 6 * n) for n in (16, 4, 1)), 6)
    red, blue = plain((200, 0, 0, 255)), plain((0, 0, 200, 255))
    baked = scene_folder(tmp_path / "baked", wall_color=red, roof_color=red, sky=sky)
    first = draw_folder(baked, sheets)
    assert {path.name for path in first.drawn} == {"wall.png", "roof.png", "sky.png"}
    assert not first.warnings
    assert draw_folder(baked, sheets).drawn == []
    scene_folder(baked, wall_color=red, roof_color=blue, sky=sky)
    assert [path.name for path in draw_folder(baked, sheets).drawn] == ["roof.png"]
    (sheets / "wall.png").unlink()
    assert [path.name for path in draw_folder(baked, sheets).drawn] == ["wall.png"]


def test_a_sky_and_an_object_are_drawn_anew_where_the_scene_shows_them_otherwise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sky = Texture("RGBA16F", 4, 4, tuple(bytes(8 * 6 * n) for n in (16, 4, 1)), 6)
    baked = scene_folder(tmp_path / "baked", wall_color=plain((200, 0, 0, 255)), sky=sky)
    scene = json.loads((baked / "scene.json").read_text())
    material = {"maps": {"color": "wall_color", "normal": None}, "alpha_cutoff": 0.5}
    material |= {"color": [1.0, 1.0, 1.0], "specular": 0.2, "smoothness": 0.3}
    item = {"mesh": "wall_mesh", "lods": [{"error_m": 0.0}], "materials": {"": material}, "instances": []}
    scene["artifacts"]["wall_mesh"] = scene["artifacts"]["wall_color"] | {"kind": "mesh"}
    scene |= {"objects": [item], "lod_error_px": 1.0}
    monkeypatch.setattr("paradize.report.folder.draw_object", draw_nothing)

    def drawn(**changes: Any) -> set[str]:
        (baked / "scene.json").write_text(json.dumps(scene | changes))
        done = draw_folder(baked, tmp_path / "report")
        assert not done.warnings
        return {path.stem for path in done.drawn}

    assert drawn() == {"wall", "wall_mesh", "sky"}
    assert drawn(exposure=2.0) == {"sky"}
    assert drawn(exposure=2.0, lod_error_px=2.0) == {"wall_mesh"}
    cut = item | {"materials": {"": material | {"alpha_cutoff": 0.25}}}
    assert drawn(exposure=2.0, lod_error_px=2.0, objects=[cut]) == {"wall_mesh"}
    moved = cut | {"instances": [{"position": [1.0, 0.0, 0.0]}]}
    assert drawn(exposure=2.0, lod_error_px=2.0, objects=[moved]) == set()


def draw_nothing(*given: object) -> bytes:
    return b""


def test_sheets_of_materials_that_are_gone_go_and_no_other_file(tmp_path: Path) -> None:
    sheets = tmp_path / "report"
    red = plain((200, 0, 0, 255))
    draw_folder(scene_folder(tmp_path / "baked", wall_color=red, roof_color=red), sheets)
    (sheets / "mine.png").write_bytes(b"not of ours")
    draw_folder(scene_folder(tmp_path / "baked", wall_color=red), sheets)
    assert {path.name for path in sheets.iterdir()} == {"wall.png", "mine.png", "sheets.json"}


def test_of_many_sheets_some_are_left_to_later(tmp_path: Path) -> None:
    red = plain((200, 30, 20, 255))
    baked = scene_folder(tmp_path / "baked", a_color=red, b_color=red, c_color=red)
    sheets = tmp_path / "report"
    first = draw_folder(baked, sheets, most=2)
    assert [path.name for path in first.drawn] == ["a.png", "b.png"] and first.left == 1
    second = draw_folder(baked, sheets, most=2)
    assert [path.name for path in second.drawn] == ["c.png"] and second.left == 0


def test_a_sheet_that_fails_is_told_and_the_others_are_drawn(tmp_path: Path) -> None:
    red = plain((200, 0, 0, 255))
    baked = scene_folder(tmp_path / "baked", wall_color=red, roof_color=red)
    (baked / "roof_color.ktx2").write_bytes(b"nothing")
    done = draw_folder(baked, tmp_path / "report")
    assert [path.name for path in done.drawn] == ["wall.png"]
    (warning,) = done.warnings
    assert "contact sheet roof" in warning
    # It is tried again.
    assert "roof" in draw_folder(baked, tmp_path / "report").warnings[0]
    (baked / "scene.json").write_bytes(b"{")
    assert "no contact sheets" in draw_folder(baked, tmp_path / "report").warnings[0]


def test_a_report_folder_that_cannot_be_written_is_a_warning(tmp_path: Path) -> None:
    baked = scene_folder(tmp_path / "baked", wall_color=plain((200, 0, 0, 255)))
    (tmp_path / "report").write_text("a file stands here")
    done = draw_folder(baked, tmp_path / "report")
    assert not done.drawn
    assert (
        "another place with PARADIZE_REPORT or --report" in done.warnings[0]
        and "Error" not in done.warnings[0]
    )


def picture(path: Path, size: int = 64) -> Path:
    y, x = np.mgrid[0:size, 0:size]
    grey = (127 + 60 * np.sin(x / 5) + 60 * np.sin(y / 7)).astype(np.uint8)
    Image.fromarray(np.dstack([grey, grey // 2, 255 - grey])).save(path)
    return path


def test_maps_draws_a_sheet_where_it_is_asked_to(
    tmp_path: Path, paradize_here: Callable[..., subprocess.CompletedProcess[str]]
) -> None:
    source = picture(tmp_path / "bark.png")
    result = paradize_here("maps", source, "-o", tmp_path / "out", "--report", tmp_path / "sheets", "--json")
    assert result.returncode == 0, result.stderr
    file = tmp_path / "sheets/bark.png"
    assert json.loads(result.stdout)["sheets"] == [str(file)]
    with Image.open(file) as drawn:
        assert drawn.width > 1000
    assert sorted(path.suffix for path in (tmp_path / "out").iterdir()) == [".ktx2"] * 4
    wrong = paradize_here(
        "maps", source, "-o", tmp_path / "o2", "--report", tmp_path / "s2", "--format", "png"
    )
    assert wrong.returncode == 1
    assert "--report" in wrong.stderr


def test_draw_maps_tells_what_it_cannot_read(tmp_path: Path) -> None:
    message = {"maps": {"normal": {"file": "a.ktx2", "errors": {}}}}
    done = draw_maps({"a.ktx2": b"nothing"}, "a", message, tmp_path, False)
    assert not done.drawn
    assert "contact sheet a" in done.warnings[0]


@pytest.fixture
def cove_bake(
    tmp_path: Path, paradize: Callable[..., subprocess.CompletedProcess[str]]
) -> Callable[[str], dict[str, Any]]:
    """Bakes the cove into the folder `out`, with a folder for its report."""
    scene = make_cove(tmp_path / "scene")

    def bake(report: str) -> dict[str, Any]:
        own = {**RENDER_ENVIRONMENT, "PARADIZE_REPORT": report, "PARADIZE_STORE": str(tmp_path / "store")}
        result = paradize("bake", scene, "-o", tmp_path / "out", "--json", env={**os.environ, **own})
        assert result.returncode == 0, result.stderr
        output: dict[str, Any] = json.loads(result.stdout)
        return output

    return bake


@pytest.mark.deep
def test_a_bake_leaves_sheets_beside_its_assets_and_draws_none_when_nothing_changed(
    tmp_path: Path, cove_bake: Callable[[str], dict[str, Any]]
) -> None:
    out = tmp_path / "out"
    assert cove_bake("")["sheets"] == []
    before = {path.name for path in out.iterdir()}
    drawn = cove_bake(str(tmp_path / "report"))["sheets"]
    scene = json.loads((out / "scene.json").read_text())
    textures = {name.rpartition("_")[0] for name, e in scene["artifacts"].items() if e["kind"] == "texture"}
    meshes = {item["mesh"] for item in scene["objects"]}
    assert {Path(path).stem for path in drawn} == textures | meshes | {"sky"}
    assert all(Path(path).parent == tmp_path / "report/out" for path in drawn)
    assert {path.name for path in out.iterdir()} == before
    assert cove_bake(str(tmp_path / "report"))["sheets"] == []


@pytest.mark.parametrize("closed", [False, True])
def test_a_report_that_cannot_be_written_is_one_warning_and_the_bake_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], closed: bool
) -> None:
    if closed:  # for who is not root
        folder = tmp_path / "report" / "out"
        folder.mkdir(parents=True)
        monkeypatch.setattr(os, "access", lambda path, mode: path != folder)
    else:
        (tmp_path / "report").write_text("a file stands here")
    monkeypatch.setenv("PARADIZE_REPORT", str(tmp_path / "report"))
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    scene = sky_and_sound(make_cove(tmp_path / "scene"))
    assert main(["bake", str(scene), "-o", str(tmp_path / "out"), "--json"]) == 0
    warnings = json.loads(capsys.readouterr().out)["warnings"]
    assert sum("another place with PARADIZE_REPORT" in text for text in warnings) == 1


def test_the_page_tells_what_was_spared_and_files_against_their_budget() -> None:
    scene = {
        "name": "a<b",
        "budget": {"hard": {"folder_mb": 1.0}, "soft": {}},
        "flight": {"errors": {}},
    }
    row = {"name": "x", "tier": "fast", "errors": {}, "over": [], "bytes": 2_000_000, "status": "baked"}
    rows = [row | {"format": "BC1_RGB_SRGB", "seconds": 1.0}]
    why = {"saved_bytes": {"levels": 0, "patches": 2_500_000, "maps": 1_000_000}, "artifacts": []}
    page = scene_page(scene, rows, why, NO_POSTER, [], seconds=1.0, warnings=[])
    assert "<b>3.5 MB</b>" in page and "<h1>a&lt;b:" in page
    assert "folder_mb" in page and 'class="meter bad"' in page and "<b>1</b><span>errors beyond" in page
    free = scene | {"budget": {"hard": {}, "soft": {}}}
    page = scene_page(free, rows, why, NO_POSTER, [], seconds=1.0, warnings=[])
    assert "The scene has no [budget]: no error is limited." in page and "errors beyond" not in page
    both = scene | {"budget": {"hard": {"folder_mb": 1.0, "color_psnr_db": 30.0}, "soft": {}}}
    page = scene_page(
        both, [rows[0] | {"errors": {"color_psnr_db": 40.0}}], why, NO_POSTER, [], seconds=1.0, warnings=[]
    )
    assert page.index("<code>folder_mb") < page.index("<code>color_psnr_db")  # what is beyond stands first
    roomy = scene | {"budget": {"hard": {"folder_mb": 3.0}, "soft": {}}}
    page = scene_page(roomy, rows, why | {"saved_bytes": None}, NO_POSTER, [], seconds=1.0, warnings=[])
    assert "<b>0 kB</b>" in page and 'class="meter bad"' not in page and "<b>none</b>" in page


def test_the_page_begins_with_the_scene_s_picture_or_says_why_there_is_none() -> None:
    scene = {"name": "a", "budget": {"hard": {}, "soft": {}}, "flight": {"errors": {}}}
    why = {"saved_bytes": None, "artifacts": []}
    for poster, shown in (
        (Poster(b"jpeg"), "data:image/jpeg;base64,anBlZw=="),
        (Poster(None, "no <GL>"), "no &lt;GL&gt;"),
    ):
        page = scene_page(scene, [], why, poster, [], seconds=1.0, warnings=[])
        assert page.index("<h1>") < page.index(shown) < page.index('<ul class="facts">')


def test_a_poster_is_drawn_once_for_each_bake_and_a_player_that_fails_is_told(tmp_path: Path) -> None:
    baked = tmp_path / "baked"
    baked.mkdir()
    (baked / "scene.json").write_text("{}")
    assert "paradize-player was not found" in draw_poster(baked, tmp_path, None).missing
    broken = tmp_path / "broken"
    broken.write_text("#!/bin/sh\necho no display >&2\nexit 1\n")
    broken.chmod(0o755)
    player = tmp_path / "player"
    Image.new("RGB", (64, 36), (0, 120, 200)).save(tmp_path / "drawn.png")
    player.write_text(
        f'#!/bin/sh\necho "$@" >> {tmp_path}/calls\nfor last; do :; done\ncp {tmp_path}/drawn.png "$last"\n'
    )
    player.chmod(0o755)
    read = "paradize.report.poster.read_scene"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(read, lambda *_: {"viewport": [1280, 720], "poster_s": 7.5})
        assert "no display" in draw_poster(baked, tmp_path, broken).missing
        for _ in range(2):
            assert draw_poster(baked, tmp_path, player).picture == (tmp_path / FILE).read_bytes()
        (baked / "scene.json").write_text('{"other": 1}')
        assert draw_poster(baked, tmp_path, player).picture
    calls = (tmp_path / "calls").read_text().splitlines()
    assert len(calls) == 2 and all("--size 1100x619 --time 7.5 " in call for call in calls)


@pytest.mark.parametrize(
    ("metric", "value", "kind", "words"),
    [
        ("color_psnr_db", 39.0, "good", "budget: at least 36 dB"),
        ("color_psnr_db", 35.0, "bad", "budget: at least 36 dB"),
        ("normal_p99_deg", 2.5, "hint", "soft budget: at most 2 degrees"),
        ("alpha_psnr_db", 41.0, "good", "from 40 dB"),
        ("dudv_p99_deg", 2.1, "hint", "up to 2 degrees"),
        ("lod_normal_p99_deg", 60.0, "plain", "coarse levels"),
        ("surface_max", 0.01, "good", "at most 1.5 px"),
        ("terrain_rms_m", 0.1, "good", "one pixel where the terrain is 1000 pixels wide"),
        ("terrain_rms_m", 0.3, "hint", "one pixel where the terrain is 1000 pixels wide"),
        ("terrain_tile_max_m", 9.0, "good", "1.5 px"),
        ("load_max_m", 2e-3, "hint", "a millimetre"),
    ],
)
def test_an_error_is_good_against_its_budget_else_against_what_the_eye_sees(
    metric: str, value: float, kind: str, words: str
) -> None:
    budget = {"hard": {"color_psnr_db": 36.0, "normal_p99_deg": 5.0}, "soft": {"normal_p99_deg": 2.0}}
    verdict = verdict_of(
        metric, value, {"budget": budget, "lod_error_px": 1.5, "terrain": {"size_m": [200.0, 150.0]}}
    )
    assert verdict.kind == kind and words in verdict.words
    assert (verdict.share is not None) == ("budget: " in verdict.words)


def test_every_error_of_the_island_has_a_meaning(island: Path) -> None:
    scene = json.loads((island / "scene.json").read_text())
    errors = [scene["flight"]["errors"], *(entry["errors"] for entry in scene["artifacts"].values())]
    assert {metric for message in errors for metric in message if not meaning_of(metric)} == set()


@pytest.mark.parametrize("metric", sorted({*METRICS, *REPORTED} - {"folder_mb", "gpu_mb"}))
def test_every_error_is_judged_without_a_budget(metric: str) -> None:
    scene = {
        "budget": {"hard": {}, "soft": {}},
        "lod_error_px": 1.0,
        "terrain": {"size_m": [100.0, 100.0]},
    }
    best = 120.0 if metric.endswith("_db") else 0.0
    assert verdict_of(metric, best, scene).kind == "good"
    worst = 5.0 if metric.endswith("_db") else 90.0
    assert verdict_of(metric, worst, scene).kind in ("hint", "plain") or metric in SWITCHED


def test_the_sheet_of_clouds_says_what_their_colours_mean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[str] = []
    monkeypatch.setattr(
        "paradize.report.folder.draw_sheet", lambda *given: written.append(given[-1].about) or b""
    )
    white = plain((255, 255, 255, 255))
    baked = scene_folder(tmp_path / "baked", clouds_color=white, wall_color=white)
    scene = json.loads((baked / "scene.json").read_text())
    scene["daytime"] = {"clouds": {"color": "clouds_color"}}
    (baked / "scene.json").write_text(json.dumps(scene))
    assert not draw_folder(baked, tmp_path / "report").warnings
    assert [text.split(":")[0] for text in written] == ["red, green, blue", ""]


def test_an_object_s_sheet_names_the_width_of_a_pixel_from_which_on_a_level_is_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An error of 0.1 m covers 2 pixels, which are accepted, where a pixel covers 0.05 m."""
    mesh = soup([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], [(0, 1, 2)])
    glb = encode_glb((Lod(mesh, 0.0, 0.0), Lod(mesh, 0.1, 0.1)), "thing")
    (tmp_path / "thing.glb").write_bytes(glb)
    measured = {"file": "thing.glb", "bytes": len(glb), "tier": "exact", "levels": [{}, {}]}
    item = {"mesh": "thing", "materials": {}, "lods": [{"error_m": 0.0}, {"error_m": 0.1}]}
    drawn: list[lod_view.Shown] = []
    monkeypatch.setattr("paradize.report.levels.draw_levels", lambda *given: drawn.extend(given[2]))
    draw_object(tmp_path, {"name": "a", "lod_error_px": 2.0, "artifacts": {"thing": measured}}, item)
    assert "drawn where a pixel covers 0.05 m or more" in drawn[1].lines


def test_a_level_is_drawn_where_it_lies_and_holes_show_what_is_behind() -> None:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float32)
    right, up, eye = lod_view.axes().astype(np.float32)

    def square(side: float, towards_m: float) -> npt.NDArray[np.float32]:
        return side * (corners[:, :1] * right + corners[:, 1:] * up) + towards_m * eye

    uvs = np.tile((0.5 + 0.5 * corners).astype(np.float32), (2, 1))
    mesh = Mesh(
        np.concatenate([square(1.0, 0.0), square(0.5, 0.3)]).astype(np.float32),
        np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], np.uint32),
        uvs=uvs,
        groups=(Group("back", "back", 0, 2), Group("front", "front", 2, 2)),
    )
    holes = np.zeros((2, 2, 4), np.float32)
    holes[:, :, 0] = 1.0
    holes[0, :, 3] = 1.0  # v below a half: opaque
    skins = {
        "back": lod_view.Skin(color=(0.0, 0.0, 1.0)),
        "front": lod_view.Skin(holes, (1.0, 1.0, 1.0), 0.5),
    }
    drawn = lod_view.draw_mesh(mesh, skins, lod_view.frame_of(mesh)).astype(int)
    side, middle = lod_view.SIZE, lod_view.SIZE // 2
    red, blue, paper = (drawn[row, middle] for row in (middle + side // 8, middle - side // 8, 2))
    assert red[0] > 150 and red[2] < 30  # v grows with the corner's height here: its lower half is opaque
    assert blue[2] > 150 and blue[0] < 30
    assert paper.max() < 40
    assert drawn[middle, side // 16 + 4, 2] > 150  # the large square reaches almost to the edge


def test_a_level_without_a_map_is_drawn_in_the_colours_of_its_vertices() -> None:
    right, up, _ = lod_view.axes().astype(np.float32)
    corners = np.array([right + up, up - right, -right - up, right - up], np.float32)
    colors = np.array([[0, 0, 1, 1], [1, 0, 0, 1], [1, 0, 0, 1], [0, 0, 1, 1]], np.float32)
    mesh = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), colors=colors)
    skins = {"": lod_view.Skin(color=(1.0, 1.0, 0.0))}
    drawn = lod_view.draw_mesh(mesh, skins, lod_view.frame_of(mesh)).astype(int)
    middle, reach = lod_view.SIZE // 2, lod_view.SIZE // 3
    left, right_side = drawn[middle, middle - reach], drawn[middle, middle + reach]
    assert left[0] > 150 and right_side[0] < 130 and max(left[1:].max(), right_side[1:].max()) < 30


@pytest.mark.parametrize(
    ("turned", "side"), sample([(False, 0.5), (True, 0.5), (False, 0.06), (True, 0.06)], every=3)
)
def test_of_squares_that_cross_each_pixel_shows_the_nearer_one_with_its_texels(
    side: float, turned: bool
) -> None:
    """In one batch of triangles, before a large square behind, whichever is drawn first."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float32)
    right, up, eye = lod_view.axes().astype(np.float32)

    def square(half: float, towards_m: float, lean: float) -> npt.NDArray[np.float32]:
        flat = half * (corners[:, :1] * right + corners[:, 1:] * up)
        return flat + (towards_m + lean * corners[:, :1]) * eye

    squares = [square(1.0, -2.0, 0.0), square(side, 0.0, -side), square(side, 0.0, side)]
    # Texels by column: green behind; blue, near on the left; red, near on the right, black in its upper half.
    uvs = [np.full((4, 2), (k / 4 + 0.125, 0.25)) for k in range(3)]
    uvs[2] = np.stack([uvs[2][:, 0], 0.5 + 0.499 * corners[:, 1]], axis=1)
    order = [2, 1, 0] if turned else [0, 1, 2]
    mesh = Mesh(
        np.concatenate([squares[k] for k in order]).astype(np.float32),
        np.array([[k, k + a, k + a + 1] for k in (0, 4, 8) for a in (1, 2)], np.uint32),
        uvs=np.concatenate([uvs[k] for k in order]).astype(np.float32),
    )
    texels = np.zeros((2, 4, 3), np.float32)
    texels[0, [0, 1, 2], [1, 2, 0]] = 1.0
    skins = {"": lod_view.Skin(texels, (1.0, 1.0, 1.0))}
    drawn = lod_view.draw_mesh(mesh, skins, lod_view.frame_of(mesh)).astype(int)
    middle, reach = lod_view.SIZE // 2, side * lod_view.SIZE * 0.47
    for across, above, color in (
        (-0.7, 0.8, 2),
        (-0.5, -0.5, 2),
        (0.5, -0.5, 0),
        (0.8, -0.1, 0),
        (0.1, -0.8, 0),
    ):
        seen = drawn[middle - round(above * reach), middle + round(across * reach)]
        assert seen[color] > 60 > max(seen[k] for k in range(3) if k != color), (across, above, seen)
    assert drawn[middle - round(0.5 * reach), middle + round(0.5 * reach)].max() < 60
    assert drawn[middle, 20][1] > 60


@pytest.mark.parametrize(
    "content", [b"{}", b"[]", b"[" * 100_000, b'{"groups": [1e400]}', b"\xff", b'{"groups": 7}']
)
def test_curves_that_are_none_are_a_warning_and_the_page_is_drawn(
    content: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where a pipe stands in their place."""
    monkeypatch.setenv("PARADIZE_STORE", str(tmp_path / "store"))
    monkeypatch.setattr("paradize.report.scene_page.scene_page", lambda *_, tradeoff, **__: _curves(tradeoff))
    monkeypatch.setattr("paradize.report.folder.read_scene", lambda *_: {"artifacts": {}})
    (tmp_path / "out").mkdir()
    (tmp_path / "out/scene.json").write_text("{}")
    for make in (lambda path: path.write_bytes(content), os.mkfifo):
        path = tmp_path / "tradeoff.json"
        path.unlink(missing_ok=True)
        make(path)
        report = BakeReport(tmp_path / "out")
        draw_page(tmp_path / "out", tmp_path, report, {}, NO_POSTER)
        assert (tmp_path / "index.html").read_text() == _curves(None)
        assert f"{path}: is not what paradize measure writes" in report.warnings[0]
