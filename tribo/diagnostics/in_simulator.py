"""The names under which ``tribo.diagnostics`` offers runs of the simulator with a mechanism at work."""

from __future__ import annotations

from tribo.mechanisms_in_model import parse_given, parse_with, simulate_with

__all__ = ["parse_given", "parse_with", "simulate_with"]
