"""From a run to the MLflow store and no further: what is logged, a queue on disk, delivery, records of runs."""
