"""A cell at rest: its voltage without what instruments add, and the state of charge that it means."""
