"""Comparison of the calibrated model with the measurement: predictions, their runs and statistics of agreement."""
