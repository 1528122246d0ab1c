"""Patterns for a wanted friction: targets, the search over families of patterns, and answers that can be made."""
