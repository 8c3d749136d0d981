"""State of charge at the first row of a record: from a rest that still relaxes, or from a start under load."""
