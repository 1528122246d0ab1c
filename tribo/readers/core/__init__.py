"""Shared by all readers: sources, layout, columns, numbers and doubts."""
