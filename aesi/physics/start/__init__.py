"""State of charge at the first row of a record: from a relaxing rest, or from a start under load."""
