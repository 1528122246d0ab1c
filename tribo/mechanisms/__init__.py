"""Why a measured campaign may differ from the baseline model: one module a mechanism, and their table."""
