"""Results that are read back from the tracking store: tables, the user interface."""
