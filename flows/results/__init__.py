"""What is read back from the tracking store: tables, the user interface."""
