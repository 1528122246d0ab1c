"""Analysis of sled friction tests: mu and tau0 with uncertainties, compared with a calibrated spring-block model.

A measurement passes through these stages: export file -> Trace -> Pull -> LawFit -> Comparison -> report. A simulation
passes through SimConfig -> Run -> LawFit. Each stage takes and returns the frozen records of :mod:`tribo.records`::

    import tribo

    campaign = tribo.load_campaign("my-campaign")
    study = tribo.study(campaign)              # ingest, fit, compare
    found = tribo.diagnose(study.ingested)     # where the model fails, and why
    tribo.write_report(study, "out", diagnosis=found)

The stub beside this file lists the public names; each is imported on first use.
"""

import os

import lazy_loader

# thousands of small matrix products: on them the threads of OpenBLAS cost more than they give
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

__version__ = "0.1.0"
__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
