"""The likelihood of a hypothesis (noise, model error, priors), its fits, and its score on unseen data."""
