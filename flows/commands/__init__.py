"""The commands of `aesi`, by subject. Arguments to one call; no logic."""
