"""The hybrid: the ensemble against PySINDy, designs of its search, and measured drives split in every way."""
