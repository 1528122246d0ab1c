"""Whatever goes wrong with one export is the fault of that test; the other tests are read, and hashed as read."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tribo import stages
from tribo.campaign import load_campaign
from tribo.records import Ingested, Pull, Trace
from tribo.report import gather_provenance


@pytest.fixture
def folder(eight_pulls: Path, tmp_path: Path) -> Path:
    copy = tmp_path / "campaign"
    shutil.copytree(eight_pulls, copy)
    return copy


def spoil(folder: Path, content: str) -> Ingested:
    """The campaign with the export of its second test replaced."""
    test = load_campaign(folder).tests[1]
    (folder / test.file).write_text(content)
    return stages.ingest(load_campaign(folder))


def trace(times: np.ndarray, forces: np.ndarray) -> str:
    rows = "\n".join(f"{t!r},{f!r}" for t, f in zip(times.tolist(), forces.tolist(), strict=True))
    return f"Time [s],Force [N]\n{rows}\n"


T = np.linspace(0.0, 10.0, 400)
F = 0.2 + 0.001 * np.sin(37.0 * T)
BAD = {
    "equal times": trace(np.full(400, 3.0), F),
    "equal times but the last": trace(np.append(np.full(399, 3.0), 4.0), F),
    "1e300": trace(T, F * 1e300),
    "one 1e300": trace(T, np.where(np.arange(400) == 200, 1e300, F)),
    "1e308 up and down": trace(T, 1e308 * np.sign(np.sin(T))),
    "5e-324": trace(T, np.full(400, 5e-324)),
    "no force": trace(T, np.zeros(400)),
    "constant": trace(T, np.full(400, 0.2)),
    "times of 1e300": trace(T * 1e300, F),
    "times of 1e-300": trace(T * 1e-300, F),
}


@pytest.mark.parametrize("content", BAD.values(), ids=BAD)
def test_an_export_of_odd_numbers_costs_no_other_test(folder: Path, content: str) -> None:
    ingested = spoil(folder, content)
    spoiled = ingested.campaign.tests[1].test_id
    assert len(set(ingested.pulls) - {spoiled}) == 7
    for fault in ingested.set_aside:
        assert fault.test_id == spoiled
        assert not any(p.kind == "unexpected" for p in fault.problems), fault.reason


def test_an_exception_while_evaluating_one_export_is_the_fault_of_that_test(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tribo import traces

    campaign = load_campaign(folder)
    evaluate, bad = traces.evaluate, campaign.tests[3].test_id

    def broken(trace: Trace, options: traces.PullOptions) -> Pull:
        if options.test and options.test.test_id == bad:
            raise ZeroDivisionError("division by zero")
        return evaluate(trace, options)

    monkeypatch.setattr(traces, "evaluate", broken)
    ingested = stages.ingest(campaign)
    (fault,) = ingested.set_aside
    assert fault.test_id == bad
    assert "this export cannot be evaluated because of an error in tribo (ZeroDivisionError: division" in fault.reason
    assert len(ingested.pulls) == 7


def test_the_provenance_holds_the_hashes_of_the_bytes_that_were_read(folder: Path) -> None:
    before = {p.relative_to(folder).as_posix(): hashlib.sha256(p.read_bytes()).hexdigest()
              for p in folder.rglob("*") if p.is_file()}  # fmt: skip
    study = stages.study(load_campaign(folder), until="fit")
    for name in before:
        (folder / name).write_text("something else")
    assert dict(gather_provenance(study).inputs) == before


def test_an_export_that_is_not_evaluated_is_hashed_as_it_was_read(folder: Path) -> None:
    test = load_campaign(folder).tests[1]
    (folder / test.file).write_text("nothing\n")
    study = stages.study(load_campaign(folder), until="ingest")
    (folder / test.file).write_text("something else")
    assert gather_provenance(study).inputs[test.file] == hashlib.sha256(b"nothing\n").hexdigest()


def test_the_table_of_manual_decisions_is_hashed_as_it_was_read(folder: Path, tmp_path: Path) -> None:
    test_id = load_campaign(folder).tests[0].test_id
    table = tmp_path / "overrides.csv"
    table.write_text(f"test_id,action,reason\n{test_id},exclude,slipped\n")
    digest = hashlib.sha256(table.read_bytes()).hexdigest()
    chosen = replace(stages.DEFAULTS, overrides=table)
    study = stages.study(load_campaign(folder), chosen, until="ingest")
    table.write_text("something else")
    assert gather_provenance(study, overrides=table).overrides["sha256"] == digest
