"""Arrays in, arrays out: numpy, scipy and numba only; nothing here knows a cell or a flow.

`compiled` and `cache_folder` say where machine code and made data are kept, `files` writes and reads whole files;
nothing else knows one.
"""
