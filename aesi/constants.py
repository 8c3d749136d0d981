"""Constants of nature (CODATA 2018, exact), of clocks, of what a cell survives, of units of reports, and of chance."""

FARADAY_C_MOL = 96485.33212331001
GAS_CONSTANT_J_MOL_K = 8.31446261815324
SECONDS_PER_HOUR = 3600.0
ZERO_CELSIUS_K = 273.15
"""Exact, as the units themselves."""
COLDEST_DEGC, WARMEST_DEGC = -60.0, 150.0
"""Of a cell: colder than any is cycled, warmer than any survives; kelvins lie above."""
MV_PER_V = 1000.0
J_PER_KJ = 1000.0
CM_PER_M = 100.0
MILLI = 1000.0
"""Thousandths in one: mohm of an ohm, mm of a metre, g of a kilogram."""
PERCENT = 100.0
"""Hundredths in one."""
LARGEST_SEED = 2**32 - 1
"""That NumPy's older generators take, by which Optuna, PySINDy, scikit-learn and emcee draw."""
