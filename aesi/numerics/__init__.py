"""Arrays in, arrays out: numpy, scipy and numba only; nothing here knows a cell or a flow.

`compiled` and `cache_folder` say where machine code and made data are kept, `array_file` reads arrays back; nothing
else knows a file.
"""
