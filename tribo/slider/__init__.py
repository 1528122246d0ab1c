"""A rigid slider pulled by a machine: laws of its contact, drives, motion, stability, files.

The stub beside this file lists the public names; each is imported on first use.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
