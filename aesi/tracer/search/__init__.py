"""Forward search over hypotheses: growth by one effect, fits, the steps taken, and the archive of fits."""
