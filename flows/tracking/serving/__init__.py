"""A hybrid model as MLflow keeps and serves it."""
