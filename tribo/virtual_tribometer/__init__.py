"""A simulated tribometer: pulls with known friction, in the export formats of real machines."""
