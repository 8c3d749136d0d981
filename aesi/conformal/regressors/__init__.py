"""Regressors of the next residual's quantiles on its history: linear, forest, boosted, normalised."""
