"""The first row of a record against a cell: rest voltages, loaded starts, and the state of charge that they mean."""
