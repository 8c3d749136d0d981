"""Rules that make a raw band from past residuals: fixed, rolling, or by quantile regression."""
