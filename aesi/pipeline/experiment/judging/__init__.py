"""The scores of an experiment's models: on each record, and on drives that were left out of every choice."""
