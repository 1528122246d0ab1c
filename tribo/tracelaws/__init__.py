"""Friction laws and machines read from whole traces: from slips, and from steps of speed.

The stub beside this file lists the public names; each is imported on first use.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
