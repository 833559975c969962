"""`bake --verify P`: derives a sample of the artifacts from their sources again and compares the bytes.

Uses a temporary store, so nothing that was baked changes.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import replace
from pathlib import Path

from paradize.build.bake import derive
from paradize.build.options import BuildOptions
from paradize.build.provenance import BakeReport
from paradize.build.tiers.tuned_settings import split_label
from paradize.build.trim import sha256_without_levels
from paradize.errors import BakeError, ParadizeError
from paradize.store.local import Store, hash_file, key_of


def sample(names: list[str], percent: float) -> list[str]:
    """Returns that share of the artifacts, at least one. The same names always give the same sample."""
    count = min(len(names), max(1, math.ceil(len(names) * percent / 100.0)))
    return sorted(sorted(names, key=lambda name: key_of("verify", name))[:count])


def verify(
    scene_path: Path, report: BakeReport, *, percent: float, options: BuildOptions
) -> tuple[list[str], list[ParadizeError]]:
    """Returns the artifacts that were checked, and an error for each that could not be derived or whose
    published bytes differ. percent: above 0, up to 100."""
    files = {artifact.name: str(artifact.file) for artifact in report.artifacts}
    chosen = sample(list(files), percent)
    labels = {artifact.name: artifact.tried["taken"] for artifact in report.artifacts if artifact.tried}
    taken = {
        name: label if split_label(label)[1] else label.partition(",")[0] for name, label in labels.items()
    }
    options = replace(options, tiers=taken | dict(options.tiers))
    with tempfile.TemporaryDirectory(prefix="paradize-verify-") as folder:
        store = Store(Path(folder))
        derived, errors = derive(store, scene_path, set(chosen), options)
        for artifact in report.artifacts:
            if artifact.name in derived and (artifact.left_out or artifact.coarser_left_out):
                whole = store.get(derived[artifact.name])
                derived[artifact.name] = sha256_without_levels(
                    whole or b"", str(artifact.file), artifact.left_out, artifact.coarser_left_out
                )
    for name in chosen:
        path = report.out / files[name]
        if name in derived and hash_file(path) != derived[name]:
            problem = f"is not what its sources give: {derived[name][:8]} as SHA-256 begins"
            errors.append(BakeError(problem, file=path, place=name, mend="bake with --force"))
    return chosen, errors
