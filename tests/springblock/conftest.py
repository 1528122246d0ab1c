"""The step of all blocks is an engine of these tests."""

import support.dense_engine  # noqa: F401
