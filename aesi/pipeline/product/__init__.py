"""The hybrid model, its predictions, and its folder on disk."""
