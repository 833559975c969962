"""Sends files to a cluster: each file once, however many jobs read it, and kept until its last job ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

from paradize.cluster.serialization import absolute
from paradize.errors import BakeError, unread
from paradize.files import read_file
from paradize.jobs.pool import Job

LARGE = 1 << 20  # bytes; larger calls are sent to the worker directly, not through the scheduler


class FileTransfer:
    """client: Dask's. jobs: all jobs that will be sent."""

    def __init__(self, client: Any, jobs: Iterable[Job]) -> None:
        self.client = client
        self.sent: dict[str, Any] = {}  # path of a file -> future of its bytes
        self.readers = Counter(absolute(path) for job in jobs for path, whole in job.files.items() if whole)

    def files(self, job: Job, address: str) -> tuple[list[str], list[Any]]:
        """Returns the paths of the files that a job reads and the futures of their bytes, which Dask names by
        their hash.

        address: worker that receives files that no worker has yet. Raises BakeError for a file that cannot be
        read.
        """
        paths = [path for path, whole in job.files.items() if whole]
        for path in paths:
            future = self.sent.get(absolute(path))
            if future is None or future.status != "finished":
                try:
                    data = read_file(path)
                except OSError as error:
                    raise unread(error, path, kind=BakeError) from None
                self.sent[absolute(path)] = self.client.scatter(data, workers=[address], hash=True)
        return [absolute(path) for path in paths], [self.sent[absolute(path)] for path in paths]

    def call(self, packed: bytes, address: str) -> Any:
        """Returns a packed call, or the future of it where it is large."""
        if len(packed) <= LARGE:
            return packed
        return self.client.scatter(packed, workers=[address], hash=False)

    def forget(self, job: Job) -> None:
        """Marks the files of a job as lost with a worker, so that they are sent again."""
        for path in job.files:
            self.sent.pop(absolute(path), None)

    def release(self, job: Job) -> None:
        """Releases the files that only this job still had to read."""
        for path in [absolute(path) for path, whole in job.files.items() if whole]:
            self.readers[path] -= 1
            if not self.readers[path]:
                self.sent.pop(path, None)
