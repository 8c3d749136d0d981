"""What a user keeps: the hybrid model, its predictions, and its folder on disk."""
