"""The sentences of a report: on a run, on a discovery, on sizes, on parameters that a refit moved."""
