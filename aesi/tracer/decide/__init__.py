"""From a search to a verdict: the model of the cell, look-alikes, adequacy, confidence, carry-over."""
