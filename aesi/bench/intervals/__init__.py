"""Benchmarks of prediction intervals: one step ahead on known series and under drift, and free-run bands."""
