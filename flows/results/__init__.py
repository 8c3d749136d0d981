"""Results that are read back from the tracking store: tables, comparisons, single candidates, the user interface."""
