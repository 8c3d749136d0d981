"""What an experiment does: config, load, fit, conformalise, evaluate, outputs."""
