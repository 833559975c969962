"""The advice in messages about a scene's TOML works: it is taken out of the message and followed."""

from __future__ import annotations

import dataclasses
import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from paradize.errors import GroupedError, ParadizeError, SceneError
from paradize.scene.schema import Faults
from paradize.scene.settings import Scene, load_scene
from tests.pipeline.scenes import ball, make_cove
from tests.sweeps import sweep


def value(text: str) -> Any:
    """The value as TOML reads it."""
    return tomllib.loads(f"it = {text}")["it"]


# --- fields: every rule of every table of a scene --------------------------------------------------

JUNK: list[Any] = [
    "?",
    1e300,
    -1e300,
    10**40,
    [],
    ["?"],
    [1e300] * 3,
    [9.0, 1.0],
    ["camera", "camera"],
    {},
    True,
]
JUNK += [{"?": 1}, {"PZ401": "?"}, {"color_psnr_db": -1.0}, {"color_psnr_db": {"?": 1}}, [1] * 2, [3, 2]]


def values(mend: str, was: Any) -> list[Any]:
    """The values that a mend of a field names."""
    if found := re.fullmatch(r"allowed: (\S+) to (\S+), or (.*)", mend):
        return [value(found[1]), value(found[2]), *found[3].split(", ")]
    if found := re.fullmatch(r"write a number or three, (\S+) to (\S+); negative: mirrored", mend):
        limits = [value(found[1]), value(found[2])]
        return [*limits, *(-limit for limit in limits), limits + limits[:1]]
    if found := re.fullmatch(r"write (\d+) to \d+ points \[x, y, z\], each (\S+) to (\S+) m", mend):
        return [[[value(limit)] * 3] * int(found[1]) for limit in (found[2], found[3])]
    if found := re.search(r"(?:(\d+) )?(?:whole )?(numbers, )?allowed: (\S+) to (\S+)", mend):
        limits = [value(found[3]), value(found[4])]
        return [[limit] * int(found[1] or 1) for limit in limits] if found[2] else limits
    if found := re.fullmatch(r"(?:allowed: |write one or more of |known: )(.*)", mend):
        words = found[1].partition("; or two of them")[0].split(", ")
        return [[word] for word in words] if mend.startswith("write") else list(words)
    if found := re.fullmatch(r"did you mean (.*)\?", mend):
        return [found[1]]
    if mend.startswith("write the smaller number"):
        return [sorted(was)]
    if found := re.fullmatch(r"write it as (\S+), without quotes|write strings in brackets, as (.*)", mend):
        return [value(found[1] or found[2])]
    if found := re.fullmatch(r"write a rule's code, as (\S+)", mend):
        return [found[1]]
    if mend == "write { soft = limit, hard = limit }":
        return [value("{ soft = 40.0, hard = 36.0 }")]
    known: dict[str, list[Any]] = {
        "write true or false": [True, False],
        "write some words": ["some words"],
        "write each once": [list(dict.fromkeys(was))] if isinstance(was, list) else [],
        "write 1 to 40 of a-z, 0-9 and _, a letter first": ["a", "a" * 40, "z_09"],
    }
    return known[mend]


DOCUMENTS = re.compile(  # mends that name other tables or files: tried below, on a whole scene
    r"write \[.*|write a path relative.*|write [0-9 tor]+ files.*|looked for in .*|move it .*|"
    r"write it|write it: .*|must .*"
)


def fields_of(table: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """(place, field) of a table of a scene and of the tables in it."""
    hints = table.__annotations__
    for field in dataclasses.fields(table):
        here = f"{place}{field.metadata['key'] or field.name}"
        yield here, field
        for inner in re.findall(r"\b[A-Z]\w+", str(hints[field.name])):
            import paradize.scene.settings as module

            kind = getattr(module, inner, None)
            if dataclasses.is_dataclass(kind) and inner not in ("Limits", "Path"):
                yield from fields_of(kind, f"{here}.")


FIELDS = dict(fields_of(Scene))


# Each third, and one of each kind of rule.
QUICK_FIELDS = [*FIELDS][::3]
QUICK_FIELDS += {field.metadata["rule"].__qualname__: place for place, field in FIELDS.items()}.values()


@pytest.mark.parametrize("place", sweep(FIELDS, test=QUICK_FIELDS))
def test_a_field_takes_the_values_that_its_refusals_name(tmp_path: Path, place: str) -> None:
    rule = FIELDS[place].metadata["rule"]
    for junk in JUNK:
        faults = Faults(tmp_path / "a.toml")
        rule(junk, place, faults)
        for error in faults.errors:
            if not error.mend or DOCUMENTS.fullmatch(error.mend):
                continue
            if not (error.place or "").startswith(place) or re.search(r"table|entries", error.what):
                continue
            inner = (error.place or "")[len(place) :].lstrip(".")
            for better in values(error.mend, junk):
                if "not a key of this table" in error.what:
                    continue
                whole: Any = better
                if isinstance(junk, dict):  # the key or the value that was refused, in its table
                    key = inner.split(".")[0]
                    if error.what in ("is no metric of a budget", "is not a code of a rule"):
                        whole = {better: 0.5 if "metric" in error.what else "off"}
                    elif error.what == "is not a key of a limit" or inner in junk:
                        whole = {key: better}
                    else:
                        continue
                again = Faults(tmp_path / "a.toml")
                rule(whole, place, again)
                assert not again.errors, (str(error), better, [str(fault) for fault in again.errors])


# --- scenes: a fault in a whole file, the advice followed in it -------------------------------------


def add(line: str, after: str) -> Callable[[str], str]:
    return lambda text: text.replace(f"{after}\n", f"{after}\n{line}\n", 1)


def put(line: str, below: str, text: str) -> str:
    assert f"{below}\n" in text
    return add(line, below)(text)


def swap(old: str, new: str) -> Callable[[str], str]:
    assert old
    return lambda text: text.replace(old, new, 1)


def top(line: str) -> Callable[[str], str]:
    return lambda text: f"{line}\n{text}"


def both(*edits: Callable[[str], str]) -> Callable[[str], str]:
    def edit(text: str) -> str:
        for one in edits:
            text = one(text)
        return text

    return edit


def number_in(mend: str) -> str:
    return re.findall(r"-?\d+(?:\.\d+)?", mend)[-1]


Follow = Callable[[str, str], str]  # the faulty text and the mend -> the text as advised


@dataclasses.dataclass(frozen=True)
class Row:
    """fault: of the cove's TOML. place: where the message finds it. follow: what the mend says, done."""

    fault: Callable[[str], str]
    place: str
    follow: Follow


INSTANCE = "[[object.instance]]\nposition = [1.0, 0.0, 2.0]"
SCENES = {
    "a table for an array": Row(
        swap(
            "[[object.instance]]\nposition = [1.0, 0.0, 2.0]\nyaw_deg = 90.0\n[[object.instance]]\n",
            "[object.instance]\n",
        ),
        "object[0].instance",
        lambda text, mend: text.replace("[object.instance]", mend.removeprefix("write ")),
    ),
    "a value for an array": Row(
        both(
            swap('name = "post"', 'name = "post"\ninstance = 3'),
            swap(INSTANCE + "\nyaw_deg = 90.0\n[[object.instance]]\n", "#\n"),
            swap("position = [-3.0, 0.0, 2.0]\nscale = 2.0\n", ""),
        ),
        "object[0].instance",
        lambda text, mend: text.replace("instance = 3\n", "").replace(
            "#\n", mend.removeprefix("write ") + "\n"
        ),
    ),
    "a value for a table": Row(
        both(top("shadow = 3"), swap("[shadow]\nsize = 256\nextent_m = 20.0\n", "#\n")),
        "shadow",
        lambda text, mend: text.replace("shadow = 3\n", "").replace(
            "#\n", mend.split(", and")[0].removeprefix("write ") + "\n"
        ),
    ),
    "values for tables": Row(
        both(
            top("particles = [3]"), swap('[[particles]]\nname = "glint"\ncenter = [0.0, 1.0, 0.0]\n', "#\n")
        ),
        "particles[0]",
        lambda text, mend: text.replace("particles = [3]\n", "").replace(
            "#\n", mend.split(", and")[0].removeprefix("write ") + '\nname = "glint"\ncenter = [0, 1, 0]\n'
        ),
    ),
    "a value for named tables": Row(
        both(
            add("material = 3", 'mesh = "post.obj"'),
            swap("[object.material.wood]\nparallax_scale = 0.01\nspecular = 0.2\n", "#\n"),
        ),
        "object[0].material",
        lambda text, mend: text.replace("material = 3\n", "").replace(
            "#\n", mend.removeprefix("write ").removesuffix(" for each name").replace("NAME", "wood") + "\n"
        ),
    ),
    "a key of a table below": Row(
        add('height = "wood.png"', 'mesh = "post.obj"'),
        "object[0].height",
        lambda text, mend: text.replace('height = "wood.png"\n', "", 1).replace(
            "[object.material.wood]\n",
            mend.removeprefix("it is a key of ").replace("NAME", "wood") + '\nheight = "wood.png"\n',
        ),
    ),
    "a key of tables below": Row(
        add("position = [0, 1, 0]", 'mesh = "post.obj"'),
        "object[0].position",
        lambda text, mend: (
            f"{text.replace('position = [0, 1, 0]', '', 1)}\n{mend.removeprefix('it is a key of ')}\n"
            "position = [0, 1, 0]\n"
        ),
    ),
    "a key of the table around": Row(
        both(swap("lods = 3\n", ""), add("lods = 3", "[object.material.wood]")),
        "object[0].material.wood.lods",
        lambda text, mend: put(
            "lods = 3",
            mend.removeprefix("it is a key of ").removesuffix("; write it right below that line"),
            text.replace("lods = 3\n", ""),
        ),
    ),
    "a table in another": Row(
        add("wind = { gust_m = 9.0 }", "[object.material.wood]"),
        "object[0].material.wood.wind",
        lambda text, mend: (
            text.replace("wind = { gust_m = 9.0 }\n", "")
            + f"{mend.removeprefix('write ').partition(',')[0]}\ngust_m = 9.0\n"
        ),
    ),
    "a table of the table around": Row(
        add("instance = { position = [0, 1, 0] }", "[object.material.wood]"),
        "object[0].material.wood.instance",
        lambda text, mend: (
            text.replace("instance = { position = [0, 1, 0] }\n", "")
            + f"{mend.removeprefix('write ').partition(',')[0]}\nposition = [0, 1, 0]\n"
        ),
    ),
    "a key of a table beside": Row(
        add("fov_deg = 40.0", 'name = "cove"'),
        "scene.fov_deg",
        lambda text, mend: put(
            "fov_deg = 40.0", mend.removeprefix("it is a key of "), text.replace("fov_deg = 40.0\n", "", 1)
        ),
    ),
    "a table that is missing": Row(
        swap("[[object.instance]]\nposition = [1.0, 0.0, 2.0]\nyaw_deg = 90.0\n[[object.instance]]\n", "#\n"),
        "object[0].instance",
        lambda text, mend: text.replace("#\n", mend.removeprefix("write ").partition(":")[0] + "\n"),
    ),
    "a file that is a folder": Row(
        swap('mesh = "post.obj"', 'mesh = "."'),
        "object[0].mesh",
        lambda text, mend: text.replace('"."', '"post.obj"'),
    ),
    "a file for a list of files": Row(
        lambda text: re.sub(r"faces = \[[^]]*\]", 'faces = "wood.png"', text),
        "sky.faces",
        lambda text, mend: text.replace('"wood.png"', mend.partition(", as ")[2], 1),
    ),
    "one thing in two maps": Row(
        add('roughness = "wood.png"\nsmoothness_map = "sand.png"', "[object.material.wood]"),
        "object[0].material.wood.smoothness_map",
        lambda text, mend: text.replace('smoothness_map = "sand.png"\n', ""),
    ),
    "a value for the budget": Row(
        top("budget = 3"),
        "budget",
        lambda text, mend: (
            text.replace("budget = 3\n", "") + "\n".join(re.findall(r"\[budget\]|\w+ = [\d.]+", mend)) + "\n"
        ),
    ),
    "a value for severities": Row(
        top("check = 3"),
        "check",
        lambda text, mend: (
            text.replace("check = 3\n", "") + "\n".join(re.findall(r'\[check\]|PZ\d+ = "\w+"', mend)) + "\n"
        ),
    ),
    "a key that is misspelt": Row(
        swap("lods = 3", "lodz = 3"),
        "object[0].lodz",
        lambda text, mend: text.replace("lodz", re.findall(r"mean (\w+)\?", mend)[0]),
    ),
    "a file that is not there": Row(
        swap('mesh = "post.obj"', 'mesh = "gone.obj"'),
        "object[0].mesh",
        lambda text, mend: (
            (Path(mend.removeprefix("looked for in ")) / "gone.obj").write_text(ball()),
            text,
        )[1],
    ),
    "a file that is not a path": Row(
        swap('mesh = "post.obj"', "mesh = 3"),
        "object[0].mesh",
        lambda text, mend: text.replace("mesh = 3", 'mesh = "post.obj"'),
    ),
    "a file outside": Row(
        swap('mesh = "post.obj"', 'mesh = "../outside.obj"'),
        "object[0].mesh",
        lambda text, mend: (
            (Path(mend.removeprefix("copy it into ")) / "outside.obj").write_text(ball()),
            text.replace("../outside", "outside"),
        )[1],
    ),
    "too few faces": Row(
        swap('"nz.exr"]', "]"),
        "sky.faces",
        lambda text, mend: text.replace('"pz.exr", ]', '"pz.exr", "nz.exr"]'),
    ),
    "errors of levels by ratio": Row(
        add("lod_errors = [0.1]", "lods = 3"),
        "object[0].lod_errors",
        lambda text, mend: text.replace("lods = 3", re.findall(r'lods_by = "\w+"', mend)[0]),
    ),
    "a size of levels by ratio": Row(
        add("lod_size_px = 50", "lods = 3"),
        "object[0].lod_size_px",
        lambda text, mend: text.replace("lods = 3", re.findall(r'lods_by = "\w+"', mend)[0]),
    ),
    "an object drawn nowhere": Row(
        both(add('views = ["shadow"]', "lods = 3"), swap("[shadow]\nsize = 256\nextent_m = 20.0\n", "")),
        "object[0].views",
        lambda text, mend: text.replace('"shadow"', f'"{re.findall("name (camera)", mend)[0]}"'),
    ),
    "a largest picture that is smaller": Row(
        add("largest_viewport = [20, 9999]", 'name = "cove"'),
        "scene.largest_viewport[0]",
        lambda text, mend: text.replace("[20, 9999]", f"[{number_in(mend)}, 9999]"),
    ),
    "a region turned over": Row(
        add("[free_camera]\nlow = [5, 0, 0]\nhigh = [1, 2, 3]", "poster_s = 2.0"),
        "free_camera.low[0]",
        lambda text, mend: text.replace("[5, 0, 0]", f"[{number_in(mend)}, 0, 0]"),
    ),
    "a near plane beyond the far one": Row(
        add("near_m = 99.0\nfar_m = 50.0", "duration_s = 8.0"),
        "flight.near_m",
        lambda text, mend: text.replace("99.0", f"{0.5 * float(number_in(mend))}"),
    ),
    "a poster after the end": Row(
        swap("poster_s = 2.0", "poster_s = 20.0"),
        "scene.poster_s",
        lambda text, mend: text.replace("20.0\n", f"{number_in(mend)}\n", 1),
    ),
    "heights of a mix turned over": Row(
        add("mix_low_m = 9.0", "sand_repeat = 8.0"),
        "terrain.mix_low_m",
        lambda text, mend: text.replace("9.0", number_in(mend)),
    ),
    "fewer targets than eyes": Row(
        swap("{ position = [0, 1, 0] }, { position = [0, 1, 0] },", "{ position = [0, 1, 0] },"),
        "flight.target",
        lambda text, mend: text.replace("target = [", "target = [ { position = [0, 1, 0] }, "),
    ),
    "a soft limit beyond the hard one": Row(
        lambda text: text + "[budget]\ncolor_psnr_db = { soft = 10.0, hard = 30.0 }\n",
        "budget.color_psnr_db.soft",
        lambda text, mend: text.replace("soft = 10.0", f"soft = {number_in(mend)}"),
    ),
    "a metric that is misspelt": Row(
        lambda text: text + "[budget]\ncolour_psnr_db = 30.0\n",
        "budget.colour_psnr_db",
        lambda text, mend: text.replace("colour_psnr_db", re.findall(r"mean (\w+)\?", mend)[0]),
    ),
}


def faults_of(scene: Path) -> list[ParadizeError]:
    try:
        load_scene(scene)
    except GroupedError as grouped:
        return list(grouped.errors)
    except SceneError as error:
        return [error]
    return []


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_is_sound_once_its_advice_is_followed(tmp_path: Path, name: str) -> None:
    row = SCENES[name]
    scene = make_cove(tmp_path / "scene")
    (tmp_path / "outside.obj").write_text(ball())
    faulty = row.fault(scene.read_text())
    assert faulty != scene.read_text()
    scene.write_text(faulty)
    message = [error for error in faults_of(scene) if error.place == row.place]
    assert len(message) == 1 and message[0].mend, faults_of(scene)
    scene.write_text(row.follow(faulty, message[0].mend))
    tomllib.loads(scene.read_text())
    assert faults_of(scene) == []
