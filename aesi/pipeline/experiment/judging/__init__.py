"""What the models of an experiment are worth: on each record, on drives that chose nothing, and side by side."""
