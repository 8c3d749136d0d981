"""Ensembles of trees: gradient boosting of quantiles, and forests flattened to arrays."""
