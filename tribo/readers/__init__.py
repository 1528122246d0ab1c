"""Readers of raw exports; ``read_export`` chooses one of ``READERS``, the machines known, by content.

The stub beside this file lists the public names; each is imported on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
