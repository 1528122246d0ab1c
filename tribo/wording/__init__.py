"""A finished verdict and a study in sentences: written once, last; nothing reads a sentence."""
