"""A scene TOML is read whole or refused whole, and every fault in it is told at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from paradize import player_limits
from paradize.errors import GroupedError, SceneError
from paradize.scene.settings import Instance, Scene, load_scene

LEAST = """
[scene]
name = "small"
[flight]
eye = [{position = [0, 1, 0]}, {position = [9, 1, 0]}, {position = [9, 1, 9]}]
target = [{position = [4, 0, 4]}, {position = [4, 0, 4]}, {position = [4, 0, 4]}]
"""


def load(folder: Path, text: str) -> Scene:
    (folder / "scene.toml").write_text(text)
    return load_scene(folder / "scene.toml")


def faults(folder: Path, text: str) -> list[str]:
    with pytest.raises((SceneError, GroupedError)) as caught:
        load(folder, text)
    return str(caught.value).splitlines()


@pytest.mark.parametrize(
    ("old", "new"),
    [("tile", "wave_repeat"), ("k", "refraction_distortion"), ("strength", "reflection_distortion")],
)
def test_a_key_of_older_scenes_is_refused_with_its_new_name(tmp_path: Path, old: str, new: str) -> None:
    found = faults(tmp_path, f'{LEAST}[water]\nwaves = "w.png"\n{old} = 1.0\n')
    assert any(f"water.{old}: is not a key of this table; its name is {new} now" in line for line in found)


def test_waves_that_would_break_are_refused_with_the_limit(tmp_path: Path) -> None:
    (tmp_path / "w.png").touch()
    found = faults(tmp_path, f'{LEAST}[water]\nwaves = "w.png"\nwave_height_m = 1.5\nwave_length_m = 10.0\n')
    assert "water.wave_height_m: is 1.5" in found[0] and "at most 1.43" in " ".join(found)


def test_the_least_scene_takes_every_default(tmp_path: Path) -> None:
    scene = load(tmp_path, LEAST)
    assert scene.head.name == "small"
    assert scene.head.viewport == (1280, 720)
    assert scene.water is None and scene.terrain is None and scene.objects == ()
    assert scene.flight.duration_s == 240.0
    assert scene.flight.eye[1].speed == 1.0


def test_every_fault_is_told_at_once_with_key_value_and_limit(tmp_path: Path) -> None:
    result = faults(
        tmp_path,
        LEAST.replace('"small"', '"Not Small"')
        + """
[sun]
elevation_deg = 120
colour = [1, 1, 1]
[[object]]
name = "palm"
mesh = "gone.obj"
lods = 99
[object.material.trunk]
parallax_scale = "deep"
[budget]
normal_p99 = 3
""",
    )
    expected = [
        ("scene.name", "'Not Small'"),
        ("sun.colour", "did you mean color?"),
        ("sun.elevation_deg", "120", "-90 to 90"),
        ("object[0].mesh", "'gone.obj'"),
        ("object[0].lods", "99", "1 to 8"),
        ("object[0].material.trunk.parallax_scale", "'deep'"),
        ("object[0].instance", "missing"),
        ("budget.normal_p99", "did you mean normal_p99_deg?"),
    ]
    assert len(result) == len(expected), result
    for words in expected:
        assert any(all(word in line for word in words) for line in result), (words, result)
    assert all("scene.toml" in line for line in result)


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e999", "true", '"4"', "[]", "{}", "2020-01-01"])
def test_a_number_is_a_finite_number(tmp_path: Path, value: str) -> None:
    message = faults(tmp_path, LEAST.replace("[flight]", f"[flight]\nfov_deg = {value}"))
    assert len(message) == 1 and "flight.fov_deg" in message[0]


def test_huge_integers_are_out_of_range_not_a_crash(tmp_path: Path) -> None:
    message = faults(tmp_path, LEAST.replace("[flight]", f"[flight]\nduration_s = {10**400}"))
    assert len(message) == 1 and "duration_s" in message[0] and len(message[0]) < 300


@pytest.mark.parametrize("path", ["../outside.png", "/etc/hostname", "a/../../outside.png", "link.png", ""])
def test_sources_stay_inside_the_scene_folder(tmp_path: Path, path: str) -> None:
    (tmp_path / "outside.png").write_bytes(b"x")
    inside = tmp_path / "scene"
    inside.mkdir()
    (inside / "link.png").symlink_to(tmp_path / "outside.png")
    message = faults(inside, LEAST + f'[sound]\nfile = "{path}"\n')
    assert len(message) == 1 and "sound.file" in message[0]
    assert ("is a link to" in message[0]) == (path == "link.png")


@pytest.mark.parametrize(
    ("path", "meant"),
    [
        ("sounds/SEA.OGG", "did you mean 'Sounds/Sea.ogg'?"),
        (r"Sounds\Sea.ogg", "did you mean 'Sounds/Sea.ogg'?"),
        ("Sounds/Seas.ogg", "did you mean 'Sounds/Sea.ogg'?"),
        ("Sounds/cafe\u0301.ogg", "did you mean 'Sounds/caf\u00e9.ogg'?"),
        ("Sounds/see.ogg", "did you mean 'Sounds/Sea.ogg'?"),
        ("Sounds/Sea.wav", "did you mean 'Sounds/Sea.ogg'?"),
        ("Sounds/other.ogg", "looked for in"),
        ("Sound/Sea.ogg", "looked for in"),
        ("Sounds/Sea.ogg/a", "looked for in"),
    ],
)
def test_a_name_that_leads_to_nothing_is_told_with_the_one_that_is_meant(
    tmp_path: Path, path: str, meant: str
) -> None:
    (tmp_path / "Sounds").mkdir()
    for name in ("Sea.ogg", "caf\u00e9.ogg"):
        (tmp_path / "Sounds" / name).write_bytes(b"x")
    (message,) = faults(tmp_path, LEAST + f"[sound]\nfile = '{path}'\n")
    assert "there is no file" in message and meant in message


def test_duplicate_object_names_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\n")
    one = '[[object]]\nname = "palm"\nmesh = "a.obj"\ninstance = [{}]\n'
    assert "object[1].name" in faults(tmp_path, LEAST + one + one)[0]
    assert "terrain" in faults(tmp_path, LEAST + one.replace("palm", "terrain"))[0]


def test_eye_and_target_come_in_pairs_and_the_eye_moves(tmp_path: Path) -> None:
    assert "4" not in LEAST.split("eye")[0]
    fewer = LEAST.replace(", {position = [4, 0, 4]}]", "]")
    assert "flight.target" in faults(tmp_path, fewer)[0]
    still = LEAST.replace("[9, 1, 9]", "[9, 1, 0]")
    assert "flight.eye[2].position" in faults(tmp_path, still)[0]


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (b"\xff\xfe[\x00", "UTF-8"),
        (b"[scene\n", "TOML"),
        (b"a = " + b"[" * 100_000, "nested|TOML"),
        (b"", "scene"),
        (b"[scene]\nname = 'a'\nname = 'b'\n", "TOML"),
    ],
)
def test_what_is_no_scene_is_refused_in_one_message(tmp_path: Path, data: bytes, word: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_bytes(data)
    with pytest.raises((SceneError, GroupedError), match=word):
        load_scene(path)


def test_a_missing_scene_and_a_folder_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="no such file"):
        load_scene(tmp_path / "nothing.toml")
    with pytest.raises(SceneError):
        load_scene(tmp_path)


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_bytes(b"\xef\xbb\xbf" + LEAST.encode())
    assert load_scene(tmp_path / "scene.toml").head.name == "small"


def test_limits_that_touch_are_refused_or_allowed_as_they_say(tmp_path: Path) -> None:
    """A view needs a depth; a step in the mix, a flat box and a poster of the last second do no harm."""
    assert any("flight.near_m" in line for line in faults(tmp_path, LEAST + "near_m = 5.0\nfar_m = 5.0\n"))
    assert load(tmp_path, LEAST + "near_m = 4.99\nfar_m = 5.0\n").flight.far_m == 5.0
    for name in ("height.png", "sand.png"):
        (tmp_path / name).write_bytes(b"x")
    terrain = '[terrain]\nheightmap = "height.png"\nsand_color = "sand.png"\nsize_m = [9, 9]\nheight_m = 1\n'
    scene = load(tmp_path, f"{LEAST}{terrain}mix_low_m = 1.5\nmix_high_m = 1.5\n")
    assert scene.terrain is not None and scene.terrain.mix_low_m == scene.terrain.mix_high_m
    assert faults(tmp_path, f"{LEAST}{terrain}mix_low_m = 1.51\nmix_high_m = 1.5\n")
    assert load(tmp_path, LEAST + "[free_camera]\nlow = [0, 2, 0]\nhigh = [1, 2, 1]\n").free_camera
    late = 'name = "small"\nposter_s = {}\nlargest_viewport = [1280, 720]'
    assert load(tmp_path, LEAST.replace('name = "small"', late.format("240.0"))).head.poster_s == 240.0
    assert faults(tmp_path, LEAST.replace('name = "small"', late.format("240.1")))


OBJECT = LEAST + '[[object]]\nname = "palm"\nmesh = "palm.obj"\n'


def table(folder: Path, text: str | bytes, more: str = "") -> Scene:
    (folder / "palm.obj").write_bytes(b"")
    (folder / "palms.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    return load(folder, OBJECT + 'instances = "palms.csv"\n' + more)


def test_a_table_of_instances_stands_behind_those_of_the_scene(tmp_path: Path) -> None:
    text = "\ufeffX, y ,z,yaw_deg,pitch_deg,roll_deg,scale_x,scale_y,scale_z\r\n\r\n# the beach\r\n"
    text += '1,2,3,10,20,30,1,-2,0.5\r\n"4",5e0,6,0,0,0,1,1,1\r\n'
    item = table(tmp_path, text, "[[object.instance]]\nposition = [7, 8, 9]\nscale = -2.0\n").objects[0]
    assert item.instances == (
        Instance(position=(7.0, 8.0, 9.0), scale=-2.0),
        Instance(position=(1.0, 2.0, 3.0), yaw_deg=10, pitch_deg=20, roll_deg=30, scale=(1.0, -2.0, 0.5)),
        Instance(position=(4.0, 5.0, 6.0), scale=(1.0, 1.0, 1.0)),
    )
    assert item.instances_file == (tmp_path / "palms.csv").resolve()


def test_thousands_of_instances_are_read(tmp_path: Path) -> None:
    rows = "".join(f"{i},0,{-i}\n" for i in range(5_000))
    instances = table(tmp_path, "x,y,z\n" + rows).objects[0].instances
    assert len(instances) == 5_000 and instances[-1].position == (4_999.0, 0.0, -4_999.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x,y,z,scale\n1,2,3,0\n", "palms.csv: line 2, column scale: is 0.0; write a number or three"),
        ("x,y,z,scale_x,scale_y,scale_z\n\n1,2,3,1,1e9,1\n", "line 3, column scale_y: is 1000000000.0"),
        ("x,y,z\n1,two,3\n", "palms.csv: line 2, column y: is 'two', not a number; allowed: -1e+09"),
        ("x,y,z\n1,nan,3\n", "line 2, column y: is nan, out of range; allowed: -1e+09 to 1e+09 m"),
        ("x,y,z\n1,1e30,3\n", "line 2, column y"),
        ("x,y,z,roll_deg\n1,2,3,4000\n", "line 2, column roll_deg: is 4000.0, out of range"),
        ("x,y,z\n1,2\n", "line 2: has 2 values, expected 3; write one for each of x, y, z"),
        ("x,y,z,yaw\n1,2,3,4\n", "header: has the unknown column 'yaw'; did you mean yaw_deg?"),
        ("x,y\n1,2\n", "header: has no column z"),
        ("x,y,z,x\n1,2,3,4\n", "header: has x twice"),
        ("x,y,z,scale,scale_x,scale_y,scale_z\n", "header: has scale beside scale_x"),
        ("x,y,z,scale_x\n1,2,3,4\n", "header: has no column scale_y"),
        ("x,y,z\n", "there are none"),
        ("x;y;z\n1;2;3\n", "header: columns are separated by semicolons, expected commas"),
        ("x\ty\tz\n1\t2\t3\n", "header: columns are separated by tabs, expected commas"),
        ("x y z\n1 2 3\n", "header: columns are separated by spaces, expected commas"),
        ("", "header: has no column x"),
        (b"\x89PNG\r\n\xff\xfe\x00", "palms.csv: byte 0: is not text"),
        ('x,y,z\n1,2,"3\n', "palms.csv: line 2"),
    ],
)
def test_a_fault_in_a_table_of_instances_is_told_with_line_and_column(
    tmp_path: Path, text: str | bytes, said: str
) -> None:
    with pytest.raises((SceneError, GroupedError)) as caught:
        table(tmp_path, text)
    assert said in str(caught.value)


def test_every_fault_of_a_table_is_told_with_those_of_the_scene(tmp_path: Path) -> None:
    with pytest.raises(GroupedError) as caught:
        table(tmp_path, "x,y,z\n1,a,b\nc,2,3\n", 'lods_by = "error"\n')
    message = str(caught.value)
    assert len(message.splitlines()) == 4 and "object[0].lod_errors" in message


@pytest.mark.parametrize(
    "scale", ["0", "0.0", "1e9", "[1, 2]", "[1, 0, 1]", '"big"', "true", "nan", "[[1], 2, 3]"]
)
def test_a_scale_that_is_no_size_is_refused(tmp_path: Path, scale: str) -> None:
    (tmp_path / "palm.obj").write_bytes(b"")
    message = faults(tmp_path, OBJECT + f"[[object.instance]]\nscale = {scale}\n")
    assert len(message) == 1 and "object[0].instance[0].scale: is " in message[0] and "mirrored" in message[0]


def test_more_instances_or_particles_than_the_player_takes_are_refused_with_the_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clouds = "".join(
        f'[[particles]]\ncenter = [0, 0, 0]\nname = "p{i}"\ncount = {count}\n'
        for i, count in enumerate((4, 600_000))
    )
    load(tmp_path, LEAST + clouds)
    result = faults(
        tmp_path, LEAST + clouds + '[[particles]]\ncenter = [0, 0, 0]\nname = "more"\ncount = 400_000\n'
    )
    for part in ("particles[1].count", "has 600000", "1000004 particles", "takes 1000000", "leave 4 out"):
        assert part in result[0]
    monkeypatch.setattr("paradize.player_limits.MOST_INSTANCES", 3)
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "rows.csv").write_text("x,y,z\n" + "1,2,3\n" * 2)
    thing = '[[object]]\nname = "{}"\nmesh = "a.obj"\ninstances = "rows.csv"\n'
    load(tmp_path, LEAST + thing.format("a"))
    result = faults(tmp_path, LEAST + thing.format("a") + thing.format("b"))
    for part in ("object[0].instance", "has 2", "4 instances", "takes 3", "leave 1 out"):
        assert part in result[0]


def test_a_table_may_hold_as_many_instances_as_a_scene(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert player_limits.MOST_INSTANCES == 200_000
    monkeypatch.setattr("paradize.player_limits.MOST_INSTANCES", 3)
    assert len(table(tmp_path, "x,y,z\n" + "1,2,3\n" * 3).objects[0].instances) == 3
    with pytest.raises(SceneError, match=r"line 5.*more than 3 instances.*takes 3 in a scene"):
        table(tmp_path, "x,y,z\n" + "1,2,3\n" * 4)
