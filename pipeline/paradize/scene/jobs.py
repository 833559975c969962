"""The jobs that a scene requires, and the artifacts of each. Does not import numpy."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Output:
    """One artifact of a job.

    artifact: its name. kind: as in scene.json; empty: it is not published. product: which of the job's
    products it is. reason: why it is required. passes: the player's render passes that read it; none: it is
    heard. many: the products <product>_1, <product>_2 ... belong to it too, as artifacts <artifact>_1 ...
    """

    artifact: str
    kind: str
    product: str
    reason: str
    passes: tuple[str, ...] = ()
    many: bool = False

    def expand(self, products: Container[str]) -> list[Output]:
        """Returns this output, and with `many` one for each numbered product that there is."""
        outputs = [self]
        while self.many and f"{self.product}_{len(outputs)}" in products:
            suffix = f"_{len(outputs)}"
            outputs.append(replace(self, artifact=self.artifact + suffix, product=self.product + suffix))
        return outputs


@dataclass(frozen=True)
class BakeJob:
    """A job that bakes some artifacts. baker: its name in the job registry (bakers/registry.py). sources:
    files by role. settings: as JSON. outputs: the artifacts. objects: the names of those that use them."""

    name: str
    baker: str
    sources: dict[str, Path]
    settings: dict[str, Any]
    outputs: tuple[Output, ...]
    objects: tuple[str, ...] = ()


@dataclass
class Requirements:
    """The jobs of a scene, in a fixed order."""

    jobs: list[BakeJob] = field(default_factory=list)

    def add(
        self,
        name: str,
        baker: str,
        sources: dict[str, Path],
        outputs: Sequence[Output],
        objects: Iterable[str] = (),
        **settings: Any,
    ) -> None:
        """Adds a job, unless it has no outputs."""
        if outputs:
            self.jobs.append(BakeJob(name, baker, sources, settings, tuple(outputs), tuple(objects)))
