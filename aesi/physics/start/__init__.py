"""The first row of a record against a cell: a rest that still relaxes, a loaded start, and what is known of either."""
