"""Arrays in, arrays out: numpy, scipy and numba only; nothing here knows a cell or a flow. `visited` is about states of
charge and temperatures all the same, as more than one room asks where rows have been.

`compiled` and `cache_folder` say where machine code and made data are kept, `files` writes and reads whole files;
nothing else knows one. `cache_folder` takes the place of made data from pooch.
"""
