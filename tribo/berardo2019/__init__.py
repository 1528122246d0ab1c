"""The diagnosis of a published table of mu and tau0."""

from __future__ import annotations





