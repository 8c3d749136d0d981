"""What the models of an experiment are worth: on each record, and on drives that chose nothing."""
