"""The stages of an experiment: read its file, load data, fit models, calibrate intervals, evaluate, write outputs."""
