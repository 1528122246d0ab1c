"""Patterns for a wanted friction."""
