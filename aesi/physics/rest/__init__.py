"""A cell at rest: its voltage without instrument faults, and the state of charge at that voltage."""
