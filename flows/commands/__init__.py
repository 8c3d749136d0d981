"""The commands of `aesi`, one module per subject. Each turns its arguments into one call and decides nothing."""
