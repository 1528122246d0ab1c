"""From the raw exports of a sled friction test to mu and tau0, beside a calibrated spring-block model.

The street a measurement walks: export file -> Trace -> Pull -> LawFit -> Comparison -> report, and beside it
SimConfig -> Run -> LawFit. Each stage takes and returns the frozen records of :mod:`tribo.records`.
"""

import os

# thousands of small matrix products: on them the threads of OpenBLAS cost more than they give
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__version__ = "0.1.0"
