"""Benchmarks of the hybrid model: speed against PySINDy, settings of the search, and prediction of unseen drives."""
