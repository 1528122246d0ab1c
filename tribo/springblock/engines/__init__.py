"""The engines of the spring-block model: fast, dense and reference, and the compiled loops they run."""

from __future__ import annotations





