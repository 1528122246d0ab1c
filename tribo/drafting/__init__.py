"""A campaign drafted from the exports at hand, or from a table of forces that were evaluated elsewhere."""
