"""Noise of a residual: white and autocorrelated, and what a model cannot explain."""
