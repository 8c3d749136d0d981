"""What a finished search tells: candidates, errors by file, what is left, which experiment comes next."""
