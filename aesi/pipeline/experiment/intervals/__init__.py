"""Prediction intervals and free-run bands of the models of an experiment."""
