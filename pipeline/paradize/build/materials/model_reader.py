"""Reads the models of a scene in worker processes, and keeps their facts in the store."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from paradize.build.estimate import memory_of, seconds_of
from paradize.build.materials.model_facts import ModelFacts, from_json, read_model_facts, to_json
from paradize.build.options import BuildOptions
from paradize.errors import ParadizeError
from paradize.jobs.code import code_digest, code_of
from paradize.jobs.limits import time_limit
from paradize.jobs.pool import Job, run_jobs
from paradize.material import Picture
from paradize.scene.settings import ObjectMaterial, SceneObject
from paradize.store.file_hashes import FileHashCache
from paradize.store.local import Store, default_root, key_of, stamp

_MODULE = "paradize.build.materials.model_facts"


@dataclass
class ReadModel:
    """A model of a scene: its facts, or the error of reading it. tried: files beside it that were read."""

    facts: ModelFacts | None = None
    error: ParadizeError | None = None
    tried: list[Path] = field(default_factory=list)


class ModelReader:
    """root: the folder that all files of a model must lie in."""

    def __init__(self, root: Path, hash_cache: FileHashCache, options: BuildOptions) -> None:
        self.root, self.hash_cache, self.options = root, hash_cache, options
        self.store = Store(default_root())

    def read(self, objects: Sequence[SceneObject]) -> list[ReadModel]:
        """Returns the models of these objects."""
        asked = [_arguments(item, self.root) for item in objects]
        keys: list[str | None] = []
        found: dict[str, ReadModel] = {}
        errors: dict[int, ParadizeError] = {}
        jobs: dict[str, Job] = {}
        for i, (item, arguments) in enumerate(zip(objects, asked, strict=True)):
            pictures = {"": arguments["all_of"], **arguments["pictures"]}
            try:
                sources = {
                    name: {role: self.hash_cache.sha256(path) for role, path in files.items()}
                    for name, files in pictures.items()
                }
                sha256 = self.hash_cache.sha256(item.mesh)
            except ParadizeError as error:
                errors[i] = error
                keys.append(None)
                continue
            key = key_of(_MODULE, code_digest(_MODULE), str(item.mesh), str(self.root), sha256, sources)
            keys.append(key)
            facts = None if self.options.force else self._stored(key)
            if facts:
                found[key] = ReadModel(facts, tried=list(facts.libraries))
            elif key not in jobs:
                files = [item.mesh, *(path for own in pictures.values() for path in own.values())]
                jobs[key] = Job(
                    f"materials of {item.name}",
                    read_model_facts,
                    arguments,
                    file=item.mesh,
                    code=code_of(_MODULE),
                    timeout_s=time_limit(seconds_of(files)),
                    memory_bytes=memory_of(files),
                )
        workers = min(self.options.workers, len(jobs))
        outcomes = run_jobs(list(jobs.values()), workers, pool=self.options.pool) if jobs else []
        for key, outcome in zip(jobs, outcomes, strict=True):
            found[key] = self._kept(key, outcome.error or outcome.value)
        return [ReadModel(error=errors[i]) if key is None else found[key] for i, key in enumerate(keys)]

    def _kept(self, key: str, answer: Any) -> ReadModel:
        """Returns what a worker answered. Stores the facts of a model, and the pictures inside it."""
        if isinstance(answer, ParadizeError):
            return ReadModel(error=answer)
        if "error" in answer:
            return ReadModel(error=answer["error"], tried=answer["tried"])
        facts: ModelFacts = answer["facts"]
        materials = dict(facts.materials)
        inside = []
        for (name, role), data in answer["data"].items():
            sha256 = self.store.put(data)
            inside.append(sha256)
            path = self.store.find(sha256)
            material = materials[name]
            source = material.material.maps[role]
            if path is None:
                continue
            picture = Picture(path, name=source.picture.name, model=source.picture.file)
            maps = {**material.material.maps, role: replace(source, picture=picture)}
            materials[name] = replace(material, material=replace(material.material, maps=maps))
        facts = replace(facts, materials=materials)
        files = {str(path): self.hash_cache.sha256(path) for path in facts.libraries}
        missing = [str(path) for path in facts.missing]
        maps_read = {
            str(source.picture.file): self.hash_cache.sha256(source.picture.file)
            for material in materials.values()
            for source in material.material.maps.values()
        }
        self.store.put_product(key, to_json(facts) | {"files": files | maps_read, "missing": missing})
        return ReadModel(facts, tried=list(facts.libraries))

    def _stored(self, key: str) -> ModelFacts | None:
        """Returns the facts in the store; None where the files that they are made of have changed."""
        entry = self.store.get_product(key)
        try:
            if entry is None or any(stamp(Path(path)) for path in entry["missing"]):
                return None
            if any(self.hash_cache.sha256(Path(path)) != old for path, old in entry["files"].items()):
                return None
            return from_json(entry)
        except (ParadizeError, LookupError, TypeError, ValueError, AttributeError):
            return None  # a file is gone, or another version of Paradize wrote the entry


def _arguments(item: SceneObject, root: Path) -> dict[str, Any]:
    """Returns the arguments of read_model_facts."""
    pictures = {name: _pictures(table) for name, table in item.materials.items()}
    return {"path": item.mesh, "root": root, "pictures": pictures, "all_of": _pictures(item)}


def _pictures(item: SceneObject | ObjectMaterial) -> dict[str, Path]:
    """The pictures of colour and alpha that the scene names."""
    return {role: path for role in ("color", "alpha") if (path := getattr(item, role))}
