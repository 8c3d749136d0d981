"""The report of a finished search: candidates, errors by file, structure of the residual, the next experiment."""
