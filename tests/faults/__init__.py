"""Faults injected at every file operation of a command."""
