"""Columns of a file and what they mean: names, units, directions, and what cannot be true of them."""
