"""A campaign whose name, files or earlier results cannot be used costs no other campaign of a build."""

from __future__ import annotations

import errno
import json
import os
import re
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any
from unittest.mock import ANY

import pytest
from click.testing import CliRunner

from tribo.campaign import table
from tribo.cli import main
from tribo.forked import ApartError, Limits
from tribo.report.provenance import read_record
from tribo.site import build, index_page, steps
from tribo.site.build import BuildOptions, _configuration
from tribo.site.history import CampaignRow, history
from tribo.site.index_page import change_points, page, series, trend_csv, write_index
from tribo.site.scan import scan
from tribo.site.steps import Step, beyond_limits, forget_other_limits, id_of, inputs_of, note

BAD_NAMES = (b"x" * 250, b"not-\xff-utf8", b"index.html", b"trend.csv", b"esc\x1b[31m", b"back\\slash")
GOOD_NAMES = (
    "a{b}c", "PDMS <new>", "<results>", "ab" * 30, "=", "plain", "with space", "ümlaut", "-dash", "a'b\"c",
    "$HOME", "A|B", "100%",
)  # fmt: skip


def drop_of(folder: Path, *names: str | bytes) -> Path:
    for name in names:
        place = os.path.join(os.fsencode(folder), name if isinstance(name, bytes) else name.encode())
        os.makedirs(place)
        with open(os.path.join(place, b"campaign.toml"), "w") as file:
            file.write("x")
    return folder


def described(drop: Path, state: Path) -> None:
    """What a build tells its workflow, in the state of a site."""
    found, ready = inputs_of(scan(drop, settle_s=0.0), state / "inputs")
    _configuration(found, ready, state / "build.json", BuildOptions())


def test_a_name_that_cannot_be_used_is_refused_with_its_reason_and_the_others_are_taken(tmp_path: Path) -> None:
    found = scan(drop_of(tmp_path, *BAD_NAMES, *GOOD_NAMES), settle_s=0.0)
    assert {c.name for c in found if c.is_ready} == set(GOOD_NAMES)
    refused = [c for c in found if c.refused]
    assert len(refused) == len(BAD_NAMES)
    for campaign in refused:
        assert "rename it" in campaign.refused[0]
        campaign.name.encode()


def test_the_workflow_knows_each_campaign_by_a_plain_name_of_its_own() -> None:
    ids = [id_of(name) for name in GOOD_NAMES]
    assert len(set(ids)) == len(GOOD_NAMES)
    assert all(re.fullmatch(r"=?[A-Za-z0-9][A-Za-z0-9_.-]{0,60}", name) for name in ids)
    assert id_of("plain") == "plain"
    assert not re.search(r"(.+)\1{9}", id_of("ab" * 30))


def test_a_file_of_a_name_that_is_not_utf8_is_listed_and_hashed(tmp_path: Path) -> None:
    drop_of(tmp_path, "a")
    with open(os.path.join(os.fsencode(tmp_path), b"a", b"pr\xfcfung.csv"), "w") as file:
        file.write("1")
    (found,) = scan(tmp_path, settle_s=0.0)
    assert found.is_ready
    assert len(found.digest) == 64
    json.dumps(dict(found.files)).encode()


def test_refused_campaigns_stand_in_the_index_with_their_reason(tmp_path: Path) -> None:
    drop, state = drop_of(tmp_path / "drop", *BAD_NAMES), tmp_path / "site" / ".tribo"
    described(drop, state)
    rows = history(tmp_path / "site")
    assert {row.state for row in rows} == {"unusable"}
    write_index(tmp_path / "site")
    assert (tmp_path / "site" / "current" / "index.html").read_text(encoding="utf-8").count("rename it") == len(rows)


def test_a_build_says_on_the_terminal_why_a_campaign_is_unusable(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(build, "_snakemake", lambda *_: subprocess.CompletedProcess([], 0, ""))
    (refused,) = drop_of(tmp_path / "drop", "index.html").iterdir()
    said = CliRunner().invoke(main, ["build", str(refused.parent), "-o", str(tmp_path / "site"), "--settle", "0"])
    assert said.exit_code == 3
    assert re.search(r"unusable: index\.html: the name of this campaign .*; rename it", said.stdout)


def test_a_campaign_that_the_system_cannot_read_is_refused_for_this_build_and_listed_by_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drop = drop_of(tmp_path / "drop", "a", "b")
    real = table._tests_file

    def failing(root: Path) -> Path:
        if root.name == "a":
            raise OSError(errno.EIO, os.strerror(errno.EIO), str(root / "tests.csv"))
        return real(root)

    for campaign in drop.iterdir():
        (campaign / "campaign.toml").write_text(
            '[campaign]\ntitle = "t"\nnominal_area_mm2 = 55.0\n[patterns.F]\ncavity = "none"\n'
        )
        (campaign / "raw").mkdir()
        (campaign / "raw" / "1.csv").write_text("1,2\n")
        (campaign / "tests.csv").write_text("test_id,file,sample,normal_load_N\nT1,raw/1.csv,F,1\n")
    with monkeypatch.context() as patched:
        patched.setattr(table, "_tests_file", failing)
        found, ready = inputs_of(scan(drop, settle_s=0.0), tmp_path / "inputs")
    (refused,) = [campaign.refused for campaign in found if campaign.refused]
    assert "a/tests.csv" in refused[0]
    assert "input/output error" in refused[0]
    assert list(ready) == ["b"]
    _, ready = inputs_of(scan(drop, settle_s=0.0), tmp_path / "inputs")
    assert ready["a"]["samples"] == ["F"]


def test_an_index_that_cannot_be_written_is_a_sentence_in_its_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fails(site: Path) -> str:
        raise OSError(errno.EIO, os.strerror(errno.EIO), str(site / "current" / "index.html"))

    monkeypatch.setattr(index_page, "write_index", fails)
    assert index_page.main([str(tmp_path), "-"]) == 1
    said = capsys.readouterr().err
    assert said.startswith(f"{tmp_path}/current/index.html: ")
    assert "input/output error" in said
    assert "Traceback" not in said


def test_a_build_shows_the_log_of_an_index_that_failed(tmp_path: Path) -> None:
    (tmp_path / "log").mkdir()
    (tmp_path / "log" / "index.log").write_text("current/index.html: no space left on device")
    note(tmp_path, Step("report", "a"), "begun")
    note(tmp_path, Step("report", "a"), "ended")
    note(tmp_path, Step("index"), "begun")
    note(tmp_path, Step("index"), "ended", 1)
    (problem,) = build._failures(tmp_path, "what Snakemake said")
    assert problem.found == "current/index.html: no space left on device"


def test_a_slash_or_a_brace_in_the_name_of_a_sample_reaches_no_path_of_the_workflow(tmp_path: Path) -> None:
    drop = drop_of(tmp_path / "drop", "a")
    names = ("F", "A/B", "{x}", "..", "$\\frac$")
    patterns = "".join(f"[patterns.{json.dumps(n)}]\ncavity = 'none'\n" for n in names)
    (drop / "a" / "campaign.toml").write_text(f'[campaign]\ntitle = "t"\nnominal_area_mm2 = 55.0\n{patterns}')
    (drop / "a" / "raw").mkdir()
    rows = ["test_id,file,sample,normal_load_N"]
    for k, name in enumerate(names):
        (drop / "a" / "raw" / f"{k}.csv").write_text("1,2\n")
        rows.append(f"T{k},raw/{k}.csv,{name},{k + 1}")
    (drop / "a" / "tests.csv").write_text("\n".join(rows) + "\n")
    _, ready = inputs_of(scan(drop, settle_s=0.0), tmp_path / "inputs")
    samples, cells = ready["a"]["samples"], ready["a"]["cells"]
    assert samples == ["F", "A%2FB", "%7Bx%7D", "..", "%24%5Cfrac%24"]
    assert len(cells) == 25
    assert not any(set("/{}\\") & set(word) for word in (*samples, *cells))


DAMAGED = (b"", b"{", b"[]", b"null", b"{}", b"[" * 100_000, b'{"status": 3}', b"\xff\xfe", b'{"status": "done"}',
           b'{"status": "unusable", "digest": "", "files": {}, "problems": [3, {"x": 1}], "finished": ""}',
           b"sample,regime\nF", b"\0" * 50, b"mu,mu\nx,y\n", b'test_id,"\n')  # fmt: skip


RESULTS = ("verdict.json", "tests.csv", "fits.csv", "campaign.nc", "../../.tribo/steps/a/report.json")


@pytest.mark.parametrize("name", RESULTS)
def test_damaged_results_of_one_campaign_leave_the_index(tmp_path: Path, name: str) -> None:
    drop, state = drop_of(tmp_path / "drop", "a", "b"), tmp_path / "site" / ".tribo"
    described(drop, state)
    place = (tmp_path / "site" / "current" / "a" / name).resolve()
    place.parent.mkdir(parents=True)
    for content in DAMAGED:
        place.write_bytes(content)
        write_index(tmp_path / "site")
        assert "campaign" in (tmp_path / "site" / "current" / "index.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["tests.csv", "fits.csv"])
def test_results_that_the_system_cannot_read_are_not_taken_for_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    real = Path.open

    def failing(self: Path, *given: Any, **named: Any) -> Any:
        if self.name == name:
            raise OSError(errno.EIO, "Input/output error", str(self))
        return real(self, *given, **named)

    state = tmp_path / "site" / ".tribo"
    described(drop_of(tmp_path / "drop", "a"), state)
    monkeypatch.setattr(Path, "open", failing)
    with pytest.raises(OSError, match="Input/output"):
        history(tmp_path / "site")


@pytest.mark.parametrize("content", [*DAMAGED, b'{"outputs": {}, "inputs": [], "inputs_sha256": "", "campaign": 7}'])
def test_a_damaged_provenance_is_said_to_be_damaged(tmp_path: Path, content: bytes) -> None:
    from click.testing import CliRunner

    from tribo.cli import main

    (tmp_path / "provenance.json").write_bytes(content)
    assert read_record(tmp_path) is None
    result = CliRunner().invoke(main, ["verify", str(tmp_path)])
    assert result.exit_code == 1
    assert "the record of inputs and outputs is damaged" in result.stderr


def test_campaigns_are_in_the_order_of_their_times_and_not_of_their_texts(tmp_path: Path) -> None:
    drop, state = drop_of(tmp_path / "drop", "later", "earlier"), tmp_path / "site" / ".tribo"
    described(drop, state)
    for name, started in {"later": "2026-01-01T23:30:00-05:00", "earlier": "2026-01-02T01:00:00+01:00"}.items():
        out = tmp_path / "site" / "current" / name
        out.mkdir(parents=True)
        (out / "tests.csv").write_text(f"test_id,set_aside,started_at\nT1,,{started}\nT2,,yesterday\n")
    assert [row.name for row in history(tmp_path / "site")] == ["earlier", "later"]


def test_a_sample_with_a_bar_in_its_name_has_its_trend() -> None:
    laws = [{("A|B", "static", "mu"): (4.0 + (k > 6), 3.9, 5.1)} for k in range(12)]
    rows = [CampaignRow(f'no "{k}"', "", "done", measured=f"2026-01-{k + 1:02d}", laws=laws[k]) for k in range(12)]
    assert "Static μ of A|B rises" in page(rows, change_points(series(rows)))
    assert '"no ""3""",2026-01-04,A|B,static,mu,4,3.9,5.1' in trend_csv(rows).splitlines()


HOSTILE = """
import os, sys, time
from tribo.cli import workflow_step

def hostile(command):
    print("was run", file=sys.stderr, flush=True)
    if "aborts" in command: os.abort()
    if "hangs" in command: time.sleep(60)
    if "eats" in command: [bytearray(10_000_000) for _ in range(1000)]
    if "asks" in command: return 1, {"problems": [{"kind": "out_of_memory", "what": "not enough memory"}]}
    if "is-killed" in command: os.kill(os.getpid(), 9)
    return 0, {}

workflow_step._run = hostile
sys.exit(workflow_step.main(sys.argv[1:]))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked")
@pytest.mark.parametrize(
    ("campaign", "status", "kind"),
    [("aborts", 0, "crashed"), ("hangs", 0, "over_time"), ("eats", 0, "over_memory"), ("asks", 0, "over_memory"),
     ("is-killed", 137, ""), ("good", 0, "")],
)  # fmt: skip
def test_a_campaign_that_crashes_hangs_or_eats_memory_is_recorded_as_unusable_with_the_reason(
    tmp_path: Path, campaign: str, status: int, kind: str
) -> None:
    folder = tmp_path / "steps" / "a"
    folder.mkdir(parents=True)
    minutes = "0.02" if kind == "over_time" else "0.5"  # a busy machine takes seconds to fill its memory

    def step(name: str) -> tuple[int, dict[str, Any], bool]:
        record = folder / f"{name}.json"
        given = [record, "--digest", "d", "--most-minutes", minutes, "--most-gigabytes", "0.5"]
        command = ["--", name, campaign, "-o", "../current/a"]
        words = [sys.executable, "-c", HOSTILE, *map(str, given), *command]
        ended = subprocess.run(words, capture_output=True, text=True, check=False)
        return ended.returncode, json.loads(record.read_text()) if record.is_file() else {}, "was run" in ended.stderr

    ended, record, ran = step("predict")
    assert ran
    assert ended == status
    assert bool(record) is (status == 0)
    problems = record.get("problems", [])
    assert [p["kind"] for p in problems] == [kind] * bool(kind)
    assert not record or record["status"] == ("unusable" if kind else "done")
    if kind in ("crashed", "over_time"):
        assert problems[0]["file"] == campaign
        assert "--most-minutes" in problems[0]["allowed"]
        assert step("report")[1:] == (ANY, False)  # it would take as long
        report = json.loads((folder / "report.json").read_text())
        assert report["problems"] == problems


def test_other_limits_are_tried_and_the_same_ones_are_not(tmp_path: Path) -> None:
    folder = tmp_path / "steps" / "a"
    folder.mkdir(parents=True)
    limits = Limits(1.0, 2.0)
    ended = asdict(beyond_limits(ApartError("over_time", "too long"), limits, "/drop/a"))
    for name, problems in {"predict": [ended], "report": [ended], "other": [{"kind": "no_load"}], "done": []}.items():
        (folder / f"{name}.json").write_text(json.dumps({"problems": problems}))
    forget_other_limits(tmp_path, limits)
    assert len(list(folder.iterdir())) == 4
    forget_other_limits(tmp_path, Limits(5.0, 2.0))
    assert {path.stem for path in folder.iterdir()} == {"other", "done"}


def test_a_campaign_that_cannot_be_listed_is_refused_with_the_reason_and_not_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drop = drop_of(tmp_path / "drop", "a", "b")
    tried = []

    def crashing(function: Any, limits: Limits) -> Any:
        tried.append(limits)
        if len(tried) == 1:
            raise ApartError("crashed", "the process that worked on it crashed (SIGABRT)")
        return [], [], []

    monkeypatch.setattr(steps, "apart", crashing)
    for rounds, made_with in ((2, "x"), (2, "x"), (3, "y")):
        found, ready = inputs_of(scan(drop, settle_s=0.0), tmp_path / "inputs", made_with)
        assert len(tried) == rounds
        assert list(ready) == (["b"] if rounds == 2 else ["a", "b"])
        if rounds == 2:
            (refused,) = [campaign.refused for campaign in found if campaign.refused]
            assert "SIGABRT" in refused[0]
