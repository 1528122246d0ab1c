"""The calibrated model beside the measurement: predictions, the runs they need, and the statistics of agreement."""
