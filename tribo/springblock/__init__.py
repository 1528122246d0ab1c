"""The two-dimensional spring-block model of Berardo et al. 2019: one run, ensembles, calibration, files.

The stub beside this file lists the public names; each is imported on first use.
"""

from __future__ import annotations

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
