"""Scores of the models of an experiment: on each record, and on training drives that were left out of every choice."""
