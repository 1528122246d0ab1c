"""Friction laws as records in one table: ``from tribo.laws.table import LAWS``."""
