"""Arrays in, arrays out: numpy, scipy and numba only; nothing here knows a file, a cell or a flow."""
