"""One likelihood for every hypothesis: noise, model error, priors; its fits and its score on unseen data."""
