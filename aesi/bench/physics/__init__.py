"""Benchmarks of the physics models: speed and accuracy against PyBaMM, calibration, and free runs on measured cells."""
