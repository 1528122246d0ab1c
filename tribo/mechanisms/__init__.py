"""What can part a measured campaign from the baseline model: one module a mechanism, and their table."""
