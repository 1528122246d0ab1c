"""Records in, matplotlib figures out: no files, no pyplot. :mod:`tribo.plot` draws each by its name."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
