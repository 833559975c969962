"""Runs jobs on the workers of a Dask cluster: scheduler.py runs on this machine, dask_worker.py on the
others."""

__all__ = ["scheduler"]
