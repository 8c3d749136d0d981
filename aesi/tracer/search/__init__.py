"""Forward search: hypotheses fitted and grown, the steps that were taken, and what is kept of the fits."""
