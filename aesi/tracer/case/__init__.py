"""What all hypotheses of one case share: records, own parameters, effects, and the simulation."""
