"""One step ahead: a method calibrates on residuals, then replays a record or runs beside a cell."""
