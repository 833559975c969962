"""Worker processes, and digests of the code that they run.

pool.py runs jobs; a crash, a hang or too much memory ends one job and no other. code.py hashes the code
behind a job, so that a changed stage bakes its artifacts again and no others.
"""
