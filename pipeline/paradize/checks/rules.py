"""All rules. A code never changes its meaning and is never used for another rule.

1xx files, 2xx meshes and their maps, 3xx textures, 4xx scenes, 5xx sounds.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from paradize.errors import MAX_MEND, MAX_PART, ParadizeError, bounded, mend_of_reading


@dataclass(frozen=True)
class Rule:
    """severity: "error" fails the check, "warning" does not. cause: why it matters; mend: what to do."""

    severity: str
    title: str
    cause: str
    mend: str


RULES: dict[str, Rule] = {
    "PZ101": Rule("error", "missing file", "a file that is asked for is not there", "bake again"),
    "PZ102": Rule(
        "error", "unreadable file", "the bytes are not what the format says", "bake again; see the place"
    ),
    "PZ103": Rule(
        "error", "hash mismatch", "a file's bytes are not those that the manifest names", "bake again"
    ),
    "PZ104": Rule("warning", "unused file", "a baked file that the manifest does not name", "bake again"),
    "PZ105": Rule(
        "error",
        "not checked",
        "the check broke on a file, and whether it is sound is not known; all others were looked at",
        "please report it, with the file",
    ),
    "PZ201": Rule("error", "index out of range", "a triangle names a vertex that is not there", "bake again"),
    "PZ202": Rule("error", "not a number", "NaN or infinity among a mesh's numbers", "mend the source"),
    "PZ203": Rule("error", "normal not of unit length", "lighting would be too bright or dark", "bake again"),
    "PZ204": Rule("error", "tangent frame not orthonormal", "bumps would lean the wrong way", "bake again"),
    "PZ205": Rule("error", "tangent sign not +1 or -1", "bumps would turn inside out", "bake again"),
    "PZ206": Rule(
        "warning",
        "degenerate triangle",
        "a triangle without area draws nothing",
        "weld the source's vertices",
    ),
    "PZ207": Rule(
        "error",
        "levels of detail out of order",
        "a coarser level has more triangles or less error",
        "bake again",
    ),
    "PZ208": Rule(
        "warning",
        "no mesh",
        "a GLB without a node that draws a mesh shows nothing",
        "export it with its meshes",
    ),
    "PZ209": Rule(
        "error",
        "level of detail farther off than it says",
        "the surface of a level lies farther from the finest level than its error_max says: it would pop",
        "bake again",
    ),
    "PZ210": Rule(
        "error",
        "material is not as measured",
        "textures would be loaded too coarse or too fine, or see-through parts drawn in a wrong order",
        "bake again",
    ),
    "PZ211": Rule(
        "error",
        "du/dv drifts",
        "a du/dv map whose mean is not zero pulls reflections to one side",
        "bake again",
    ),
    "PZ212": Rule(
        "error",
        "du/dv is not its normal map's",
        "the ripples that bend the picture are not those that light the waves",
        "bake both from one source",
    ),
    "PZ213": Rule(
        "error",
        "mip level shows something else",
        "a level is not the mean of the finest one: it would change colour, tilt or place with distance",
        "bake again",
    ),
    "PZ214": Rule(
        "error",
        "gloss does not widen",
        "a level is smoother than its averaged normals allow, and would sparkle from afar",
        "bake gloss and normal from one source",
    ),
    "PZ215": Rule(
        "error",
        "normal map is not its height map's",
        "where the heights slope, the normals do not lean that way: parallax and light would disagree",
        "bake both from one source; of authored maps, turn green or the height round",
    ),
    "PZ221": Rule(
        "error",
        "gutter bleeds",
        "beside a UV island a sample reads texels of another island",
        "bake again; move the islands apart, or accept more with the object's bleed",
    ),
    "PZ222": Rule(
        "error",
        "parallax leaves its gutter",
        "the steepest look moves a sample out of its UV island's gutter",
        "bake again, or make the material's parallax_scale smaller",
    ),
    "PZ223": Rule(
        "warning",
        "mips end early",
        "from afar the flight would use coarser levels, where islands of the map bleed into each other: it "
        "may shimmer without them",
        "accept more with the object's bleed, paint neighbouring islands alike, or move them apart; if "
        'nothing shimmers, write PZ223 = "off" under [check]',
    ),
    "PZ231": Rule(
        "error",
        "texture coordinates out of range",
        "a material says that its coordinates stay inside 0 to 1, but some do not: border texels would smear",
        "move them inside, or say with wrap under its [[object]] what lies beyond the edges of its maps",
    ),
    "PZ232": Rule(
        "warning",
        "texture coordinates overlap",
        "two places of an object share texels of its occlusion map: the shade of one shows on the other",
        'lay the islands apart; if it is meant so, write PZ232 = "off" under [check]',
    ),
    "PZ233": Rule(
        "warning",
        "texel density uneven",
        "parts of an object have many times the texels of others for the same area",
        'scale the islands; if it is meant so, write PZ233 = "off" under [check]',
    ),
    "PZ234": Rule(
        "warning",
        "part inside out",
        "a closed part of a mesh faces inwards, so that its far side is drawn, or more than a quarter of it "
        "away from its normals, so that it is lit from behind",
        "flip its faces in your modelling tool, or draw its material two_sided; if it looks right there, "
        "compute its normals anew; if it is seen from within, "
        'write PZ234 = "off" under [check]',
    ),
    "PZ301": Rule("error", "mip chain incomplete", "levels down to 1 x 1 are missing or short", "bake again"),
    "PZ302": Rule("error", "texel not a number", "NaN or infinity in a float texture", "mend the source"),
    "PZ303": Rule(
        "error", "wrong colour space", "colour must be sRGB and every other map linear", "bake again"
    ),
    "PZ304": Rule(
        "error",
        "last level is not there",
        "a scene lets the player read a coarser level than its texture has: gutters would bleed from afar",
        "bake again",
    ),
    "PZ401": Rule(
        "error",
        "budget exceeded",
        "a measured error is worse than the scene's hard limit, or the files take more than it allows",
        "bake with the tier that is named, improve the source, or allow more in [budget]",
    ),
    "PZ402": Rule("warning", "unused artifact", "no pass of the scene reads it", "remove it, or bake again"),
    "PZ403": Rule(
        "error",
        "camera path jumps",
        "position or velocity differs from one segment to the next",
        "bake again",
    ),
    "PZ404": Rule(
        "error", "tile is not the scene's", "a tile holds other patches than scene.json says", "bake again"
    ),
    "PZ405": Rule(
        "error", "crack in the terrain", "patches that are drawn together do not meet", "bake again"
    ),
    "PZ406": Rule(
        "warning",
        "soft budget exceeded",
        "a measured error is worse than the scene's soft limit, inside the hard one",
        "bake with the tier that is named, improve the source, or allow more in [budget]",
    ),
    "PZ407": Rule(
        "warning",
        "unused waiver",
        "a [[waiver]] or a severity in [check] matches no finding, or names no rule",
        "remove it from the scene, and bake again",
    ),
    "PZ411": Rule(
        "error",
        "camera path under ground",
        "the camera passes below the terrain",
        "lift the waypoints before and after that second",
    ),
    "PZ412": Rule(
        "warning",
        "camera path too near",
        "a surface comes nearer to the camera than the near plane: it is cut open",
        "move the waypoints away, or make near_m smaller",
    ),
    "PZ413": Rule(
        "error",
        "terrain beyond its bound",
        "a patch lies farther from the finest ground than the errors of both allow",
        "bake again",
    ),
    "PZ421": Rule(
        "error",
        "worse than before",
        "a measured error grew by more than the accepted share since the earlier bake",
        "bake with a more exact tier, or take back what changed; --worse-by accepts more",
    ),
    "PZ422": Rule(
        "warning",
        "artifact new or gone",
        "the earlier bake holds other artifacts",
        "nothing, if the scene was changed so",
    ),
    "PZ423": Rule(
        "warning",
        "larger than before",
        "a file grew by more than the accepted share since the earlier bake",
        "look at its format and tier; --worse-by accepts more",
    ),
    "PZ424": Rule(
        "warning",
        "light reaches nothing",
        "no object, no terrain and no water is inside its range",
        "move the [[light]], make its range_m larger, or take it out",
    ),
    "PZ425": Rule(
        "warning",
        "light is never on",
        "its color or intensity is 0, or it goes off when it goes on",
        "mend color, intensity, on_s and off_s of the [[light]], or take it out",
    ),
    "PZ426": Rule(
        "error",
        "light is missing where it reaches",
        "what is drawn with a set of lights would stay dark beside this light",
        "bake again",
    ),
    "PZ427": Rule(
        "warning",
        "sun is not the sky's",
        "the sky is an HDR picture with one light that outshines all others, and shadows come from elsewhere",
        "let [sun] stand where the sky's sun does, or turn the picture",
    ),
    "PZ431": Rule(
        "error",
        "scene refused",
        "a scene's TOML has a field that is unknown or out of range, or names a file that is not there",
        "see the place; `paradize bake --help` names the page of all fields",
    ),
    "PZ501": Rule(
        "warning",
        "sound clicks where it loops",
        "the end of a sound does not continue into its start",
        "fade the end into the start, or cut at a zero crossing of the same slope",
    ),
    "PZ502": Rule(
        "warning",
        "sound is clipped",
        "samples lie beyond full scale: the player cuts them off, which distorts",
        "make it quieter before it is encoded",
    ),
    "PZ503": Rule(
        "warning",
        "placed sound has two channels",
        "a place has one sound: the player plays the mean of both channels, in which parts may cancel",
        "mix it down to mono, or leave out its position or line",
    ),
    "PZ504": Rule(
        "warning",
        "loudness is unusual",
        "a sound is hardly heard, or is so loud that nothing else is (integrated loudness, BS.1770)",
        "change its level, and say with volume how loud it is in the scene",
    ),
}


@dataclass(frozen=True)
class Finding:
    """A fault that a rule found. place: where in the file. count: the number of equal faults; the first is
    described. artifact, metric: what it is about, if known. override: the severity that the scene gives the
    rule. waived: why and until which day it does not count."""

    code: str
    file: str
    what: str
    place: str = ""
    count: int = 1
    mend: str = ""
    artifact: str = ""
    metric: str = ""
    override: str = ""
    waived: str = ""

    def __post_init__(self) -> None:
        for name, most in (
            ("what", MAX_PART),
            ("place", MAX_PART),
            ("mend", MAX_MEND),
        ):
            object.__setattr__(self, name, bounded(getattr(self, name), most))

    @property
    def severity(self) -> str:
        return self.override or RULES[self.code].severity

    @property
    def fails(self) -> bool:
        """Whether it fails the check."""
        return self.severity == "error" and not self.waived

    @property
    def title(self) -> str:
        return RULES[self.code].title

    def __str__(self) -> str:
        return self.line()

    def line(self, *, mend: bool = True) -> str:
        """The finding in a line, with what to do about it."""
        head = ": ".join(part for part in (self.file, self.place) if part)
        times = f" ({self.count} such)" if self.count > 1 else ""
        advice = f"; {self.mend or RULES[self.code].mend}" if mend else ""
        if self.waived:
            return f"{head}: waived {self.code}: {self.what}{times}; {self.waived}"
        return f"{head}: {self.severity} {self.code}: {self.what}{times}{advice}"


def isolated(findings: Iterable[Finding], file: str) -> Iterator[Finding]:
    """The findings; an error that ends their search becomes one more finding, so that others are still
    searched."""
    try:
        yield from findings
    except ParadizeError as error:
        yield Finding("PZ102", error.file or file, error.what, error.place or "")
    except OSError as error:
        yield Finding(
            "PZ101", file, f"cannot be read: {error.strerror or error}", mend=mend_of_reading(error)
        )
    except Exception as error:
        yield Finding("PZ105", file, f"internal error: {type(error).__name__}: {error}")


def gathered(findings: Iterable[Finding]) -> list[Finding]:
    """Findings with the same code, file and text become one with the sum of their counts, in the order of the
    first. Faults of a scene's TOML stay apart: each is mended where it stands."""
    merged: dict[tuple[str, ...], Finding] = {}
    for finding in findings:
        key = (finding.code, finding.file, finding.what, finding.place if finding.code == "PZ431" else "")
        if key in merged:
            finding = replace(merged[key], count=merged[key].count + finding.count)
        merged[key] = finding
    return list(merged.values())
