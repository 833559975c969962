"""Worker processes, and digests of the code that they run.

pool.py runs jobs in worker processes: `run_jobs` gives what `job.call(**job.arguments)` would give here. If a
job crashes, hangs or takes too much memory, only that job fails.
code.py hashes the code behind a job, so that a changed stage bakes only its own artifacts again.
"""

__all__ = ["code", "isolate", "libraries", "limits", "pool", "process", "progress", "worker"]
