"""From scores to a verdict: forward search, admission, look-alikes, adequacy, carry-over."""
