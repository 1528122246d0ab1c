"""From the raw exports of a sled friction test to mu and tau0, beside a calibrated spring-block model.

The street a measurement walks: export file -> Trace -> Pull -> LawFit -> Comparison -> report, and beside it
SimConfig -> Run -> LawFit. Each stage takes and returns the frozen records of :mod:`tribo.records`.
"""

__version__ = "0.1.0"
