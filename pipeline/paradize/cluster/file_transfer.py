"""What travels to a cluster: files, each once however many jobs read it, for as long as one still will."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

from paradize.cluster.serialization import full
from paradize.errors import BakeError
from paradize.files import read_file
from paradize.jobs.pool import Job

LARGE = 1 << 20  # bytes of a call that do not go by the scheduler's books


class FileTransfer:
    """client: Dask's. jobs: all that will be sent."""

    def __init__(self, client: Any, jobs: Iterable[Job]) -> None:
        self.client = client
        self.there: dict[str, Any] = {}  # a file's path -> the future of its bytes
        self.readers = Counter(full(path) for job in jobs for path, whole in job.files.items() if whole)

    def files(self, job: Job, address: str) -> tuple[list[str], list[Any]]:
        """The files that a job reads: where they are here, and the futures of their bytes, which Dask names
        by their hash. address: of the worker that is to have those that are nowhere yet. Raises BakeError
        for a file that cannot be read."""
        paths = [path for path, whole in job.files.items() if whole]
        for path in paths:
            held = self.there.get(full(path))
            if held is None or held.status != "finished":
                try:
                    data = read_file(path)
                except OSError as error:
                    raise BakeError(f"cannot be read: {error.strerror or error}", file=path) from None
                self.there[full(path)] = self.client.scatter(data, workers=[address], hash=True)
        return [full(path) for path in paths], [self.there[full(path)] for path in paths]

    def call(self, packed: bytes, address: str) -> Any:
        """A packed call, or the future of one that is large."""
        if len(packed) <= LARGE:
            return packed
        return self.client.scatter(packed, workers=[address], hash=False)

    def lost(self, job: Job) -> None:
        """A worker went with some of these files: they are to be sent anew."""
        for path in job.files:
            self.there.pop(full(path), None)

    def done(self, job: Job) -> None:
        """Lets go of what only this job still had to read."""
        for path in [full(path) for path, whole in job.files.items() if whole]:
            self.readers[path] -= 1
            if not self.readers[path]:
                self.there.pop(path, None)
