"""Mechanisms at work inside the spring-block model: on its blocks and springs, and in the measuring chain.

The stub beside this file lists the public names; each is imported on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
