"""The missing law: a complete search of a small grammar where a misfit follows a column and no mechanism."""

from __future__ import annotations





