"""What a calibration takes of measured records: rows, a start, a temperature, and the zero of their current."""
