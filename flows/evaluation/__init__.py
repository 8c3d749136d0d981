"""Candidates in, outcomes out: processes, Dask workers, and the store of outcomes that they share."""
