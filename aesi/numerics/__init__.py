"""Arrays in, arrays out: numpy, scipy and numba only; nothing here knows a cell or a flow. The exception is `visited`,
states of charge and temperatures of fitted rows, which the sparse correction and its bands both need.

Only `compiled` and `files` know files: where machine code and generated data are kept, and how a file is written whole.
The folder of generated data is pooch's.
"""
