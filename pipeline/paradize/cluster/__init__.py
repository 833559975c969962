"""Runs jobs on the workers of a Dask cluster: scheduler.py here, dask_worker.py there."""
