"""What is recorded of a run: the command line, the time, the inputs and the options."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tribo.records import Study
    from tribo.report.provenance import Provenance
    from tribo.stages import StudyOptions


def provenance_of_run(study: Study, campaign: Path, chosen: StudyOptions) -> Provenance:
    """Provenance of a study run by this command."""
    from tribo.report import gather_provenance

    options = {**chosen.as_words(), "flat": study.ingested.campaign.flat_sample}
    if study.simulated is None:
        del options["runs"]  # nothing was simulated
    return gather_provenance(
        study,
        command=command_line(),
        seed=chosen.seed,
        started_at=now(),
        options=options,
        campaign=campaign,
        overrides=chosen.overrides,
    )


def command_line() -> str:
    import shlex
    import sys

    return shlex.join(["tribo", *sys.argv[1:]])


def now() -> str:
    """The time of this run, or that of SOURCE_DATE_EPOCH (reproducible-builds.org) where it is set."""
    import os
    from datetime import UTC, datetime

    fixed = os.environ.get("SOURCE_DATE_EPOCH")
    now = datetime.fromtimestamp(int(fixed), UTC) if fixed else datetime.now(UTC)
    return now.isoformat(timespec="seconds")
