"""The choice among the candidates: the mean of the fittest, and nested cross-validation of that choice."""
