"""The record that a finished step of the workflow leaves.

What the steps of a build are told of each campaign: place, digest, samples and cells, and its files by content.
"""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from tribo.errors import CampaignError, is_of_the_system, unexpected
from tribo.files import text_of, write_text
from tribo.site.scan import Dropped

OF_A_REPORT = ("status", "digest", "problems", "finished")
_TYPES: dict[str, type | tuple[type, ...]] = {
    "status": str, "digest": str, "finished": str, "files": dict, "problems": list, "samples": list, "cells": list,
}  # fmt: skip


def read_record(path: Path, *keys: str) -> dict[str, Any] | None:
    """The record of a finished step; None where there is none, or a damaged one that lacks any of ``keys``.

    Raises
    ------
    OSError
        It is there and cannot be read.
    """
    try:
        record = json.loads(text_of(path))
    except (FileNotFoundError, NotADirectoryError, ValueError, RecursionError):
        return None
    whole = isinstance(record, dict) and all(isinstance(record.get(key), _TYPES[key]) for key in keys)
    return record if whole else None


def inputs_of(found: Iterable[Dropped], folder: Path) -> tuple[tuple[Dropped, ...], dict[str, dict[str, Any]]]:
    """The campaigns, and the inputs of the steps of each that can be built, by name.

    A campaign that the system cannot read now is refused with path and cause; the next build tries it again. What was
    listed is kept in ``folder``, a file for each campaign, until the campaign changes.
    """
    campaigns, inputs = [], {}
    for campaign in found:
        if campaign.is_ready:
            try:
                samples, cells = _listed(campaign, folder)
            except CampaignError as why:
                campaigns.append(replace(campaign, refused=tuple(map(str, why.problems))))
                continue
            inputs[campaign.name] = _inputs(campaign, samples, cells)
        campaigns.append(campaign)
    return tuple(campaigns), inputs


def _inputs(campaign: Dropped, samples: list[str], cells: list[str]) -> dict[str, Any]:
    return {
        "path": str(campaign.path), "digest": campaign.digest, "samples": samples, "cells": cells,
        "files": f"inputs/{campaign.name}.json",
        "overrides": shlex.join(["--overrides", str(campaign.overrides)]) if campaign.overrides else "",
    }  # fmt: skip


def _listed(campaign: Dropped, folder: Path) -> tuple[list[str], list[str]]:
    """Samples and cells of a campaign, those that are kept where it has not changed."""
    file = folder / f"{campaign.name}.json"
    known = read_record(file, "digest", "samples", "cells")
    if known is None or known["digest"] != campaign.digest:
        samples, cells = _to_simulate(campaign)
        known = {"digest": campaign.digest, "samples": samples, "cells": cells, "files": dict(campaign.files)}
        write_text(file, json.dumps(known, indent=1) + "\n")
    return known["samples"], known["cells"]


def _to_simulate(campaign: Dropped) -> tuple[list[str], list[str]]:
    """Samples and cells as a campaign describes them; none where it cannot be used (its first step says why).

    Raises
    ------
    CampaignError
        The system cannot read it.
    """
    from tribo.campaign import open_campaign
    from tribo.comparison.prediction import cell_name, loads_to_simulate, sample_as_word

    try:
        with open_campaign(campaign.path) as opened:
            measured = {test.sample for test in opened.tests}
            samples = [s for s in opened.samples if s in measured]
            words = [sample_as_word(s) for s in samples]
            pressures = [opened.nominal_pressure_Pa(load) for load in loads_to_simulate(opened)]
            return words, [cell_name(s, p) for s in samples for p in pressures]
    except CampaignError as why:
        problems = why.problems
    except Exception as why:  # of an error in tribo, its first step will say it again, as the fault of this campaign
        problems = (unexpected(why, "the samples of this campaign cannot be listed", str(campaign.path)),)
    of_system = [problem for problem in problems if is_of_the_system(problem.kind)]
    if of_system:
        raise CampaignError(of_system)
    return [], []
