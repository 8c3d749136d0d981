"""Columns of a file: their quantities, units and signs, and checks of their values."""
