"""Measured records prepared for a calibration: rows, initial state, temperature, and zero offset of the current."""
