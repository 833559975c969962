"""Whether a measured error is good: against the scene's budget, or without one against what the eye sees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from paradize.scene.budget import METRICS, is_beyond

# Rules of thumb by the end of a metric's name: up to which value (of dB from which value on) the eye sees no
# difference, and the rule in words.
EYE = (
    ("_psnr_db", 40.0, "from 40 dB on the eye hardly sees a difference"),
    ("_deg", 2.0, "up to 2 degrees shading looks the same"),
    ("_relative", 0.01, "the eye sees steps of brightness from about 1 %"),
    ("path_ripple_max", 0.01, "the eye sees changes of speed from about 1 %"),
    ("path_ripple_p99", 0.01, "the eye sees changes of speed from about 1 %"),
    ("load_max", 0.001, "one pixel where the object is 1000 pixels long"),
    ("quantise_max", 0.001, "one pixel where the object is 1000 pixels long"),
    ("quantise_uv_max", 0.0005, "half a texel of a map of 1024"),
    ("quantise_color_max", 0.004, "a step of 8 bits"),
    ("quantise_sway_max", 0.01, "a hundredth of the sway, below a pixel where the sway is 100 pixels wide"),
    ("occlusion_cast_mean", 0.02, "the eye hardly sees 2 % of soft shade"),
    ("occlusion_cast_p99", 0.05, "the eye hardly sees 5 % of soft shade on 1 % of the texels"),
    ("lod_seen_silhouette", 0.01, "a level may be off by 1 % of its pixels before its switch shows"),
    ("lod_seen_flip", 0.01, "a change that nobody looks for is not seen below 1 % of FLIP"),
    ("uv_shift_max", 0.01, "this is the worst place; uv_shift_p99 decides where levels are drawn"),
    ("path_time_s", 0.016, "a frame at 60 Hz"),
    ("path_jump_m_per_u", 1e-6, "rounding alone leaves less"),
    ("path_jump_m_per_u2", 1e-6, "rounding alone leaves less"),
    ("_m", 0.001, "a millimetre, about a pixel from a metre away"),
    ("_max", 0.1, "this is the worst texel; PSNR, or the error of 99 of 100 texels, says how the map looks"),
)
_TERRAIN = 0.001  # of its width
SWITCHED = (
    "terrain_tile_max_m",
    "surface_max",
    "surface_rms",
    "uv_shift_p99",
)  # the player's distances follow these
_COARSE = ("lod_normal_", "lod_mapped_")


@dataclass(frozen=True)
class Verdict:
    """kind: good, hint, bad or plain (the classes of the page). words: the comparison. share: of the budget,
    in 0 to 1; None without a budget."""

    kind: str
    words: str
    share: float | None = None


def verdict_of(metric: str, value: float, scene: Mapping[str, Any]) -> Verdict:
    """Compares an error with the budget of a scene.json; without one, with what the eye sees."""
    hard, soft = (scene["budget"][part].get(metric) for part in ("hard", "soft"))
    limit = hard if hard is not None else soft
    if limit is not None and metric in METRICS:
        return _against_budget(metric, value, limit, soft)
    if metric in SWITCHED and "lod_error_px" in scene:
        return Verdict(
            "good", f"a level is drawn only where it is off by at most {scene['lod_error_px']:g} px"
        )
    if metric in ("terrain_max_m", "terrain_rms_m") and scene.get("terrain"):
        good = value <= _TERRAIN * max(scene["terrain"]["size_m"])
        words = "one pixel where the terrain is 1000 pixels wide; nearer views: see `paradize explain`"
        return Verdict("good" if good else "hint", words)
    for end, most, words in EYE:
        if metric.endswith(end):
            good = value >= most if end == "_psnr_db" else value <= most
            if not good and metric.startswith(_COARSE):
                return Verdict("plain", f"{words}; coarse levels are drawn small")
            return Verdict("good" if good else "hint", words)
    return Verdict("plain", "neither a budget nor a rule of thumb")


def _against_budget(metric: str, value: float, limit: float, soft: float | None) -> Verdict:
    less = METRICS[metric].less_is_better
    if not less:  # of dB the error that they stand for counts
        share = 10.0 ** min((limit - value) / 20.0, 1.0)
    elif limit > 0.0:
        share = value / limit
    else:
        share = float(value > 0.0)
    share = min(max(share, 0.0), 1.0)
    words = f"budget: at {'most' if less else 'least'} {limit:g} {METRICS[metric].unit}"
    if is_beyond(metric, value, limit):
        return Verdict("bad", words, share)
    if soft is not None and is_beyond(metric, value, soft):
        return Verdict(
            "hint", f"soft budget: at {'most' if less else 'least'} {soft:g} {METRICS[metric].unit}", share
        )
    return Verdict("good", words, share)
