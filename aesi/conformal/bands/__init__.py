"""Rules from the past residuals to a raw band: fixed, rolling, or by quantile regression."""
