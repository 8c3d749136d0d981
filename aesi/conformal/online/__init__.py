"""Intervals one step ahead: a method is calibrated on residuals, then replays a record or runs online with a cell."""
