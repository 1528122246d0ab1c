"""Many campaigns in a drop folder, built into one site: what is due, one build at a time, dated copies, an index."""

from __future__ import annotations





