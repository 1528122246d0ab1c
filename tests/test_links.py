"""A link that leads out of a campaign is refused in a sentence; neither names nor contents of its target are shown."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from tribo import stages
from tribo.campaign import load_campaign, open_campaign
from tribo.errors import CampaignError, TriboError
from tribo.files import LEADS_OUT, leads_out
from tribo.ingestion.overrides import apply_overrides
from tribo.own_folder import place_problems
from tribo.report.provenance import file_hash, input_names, verify
from tribo.site.scan import LEADS_NOWHERE, scan

SECRET = "secret-name,secret content\n"


@pytest.fixture
def campaign(small_campaign: Path, tmp_path: Path) -> Path:
    """A campaign of its own in a drop folder."""
    return Path(shutil.copytree(small_campaign, tmp_path / "drop" / "campaign"))


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    """A folder outside of the campaign."""
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    for name in ("campaign.toml", "tests.csv", "secret-file.csv"):
        (folder / name).write_text(SECRET)
    return folder


def put_link(at: Path, target: Path) -> None:
    """A link in place of what lies there."""
    if at.is_dir():
        shutil.rmtree(at)
    else:
        at.unlink(missing_ok=True)
    at.symlink_to(target, target_is_directory=target.is_dir())


def refused(folder: Path) -> list[tuple[str, str | None]]:
    with pytest.raises(CampaignError) as caught, open_campaign(folder):
        pass
    assert "secret" not in str(caught.value)
    return [(p.kind, p.file) for p in caught.value.problems]


@pytest.mark.parametrize("name", ["campaign.toml", "tests.csv", "raw"])
def test_a_part_of_a_campaign_that_is_a_link_out_of_it_is_refused(campaign: Path, elsewhere: Path, name: str) -> None:
    put_link(campaign / name, elsewhere / name if name != "raw" else elsewhere)
    assert refused(campaign) == [("link", name)]
    assert not any("secret" in found or found.startswith(name) for found in input_names(campaign))


def test_all_links_are_named_at_once(campaign: Path, elsewhere: Path) -> None:
    for name in ("campaign.toml", "tests.csv", "raw"):
        put_link(campaign / name, elsewhere / name if name != "raw" else elsewhere)
    assert refused(campaign) == [("link", "campaign.toml"), ("link", "tests.csv"), ("link", "raw")]


@pytest.mark.parametrize("way", ["relative", "absolute", "chain", "dangling", "device"])
def test_every_way_out_is_seen(campaign: Path, elsewhere: Path, way: str) -> None:
    targets = {
        "relative": Path("../../elsewhere/tests.csv"), "absolute": elsewhere / "tests.csv", "chain": Path("raw/step"),
        "dangling": Path("/nowhere/at/all"), "device": Path("/dev/zero"),
    }  # fmt: skip
    (campaign / "raw" / "step").symlink_to(elsewhere / "tests.csv")
    put_link(campaign / "tests.csv", targets[way])
    assert refused(campaign) == [("link", "tests.csv")]


def test_an_export_behind_a_link_is_neither_read_nor_hashed_nor_named(campaign: Path, elsewhere: Path) -> None:
    first = load_campaign(campaign).tests[0]
    put_link(campaign / first.file, elsewhere / "secret-file.csv")
    (campaign / "raw" / "unlisted").symlink_to(elsewhere)
    loaded = load_campaign(campaign)
    assert [(s.test_id, [p.kind for p in s.problems]) for s in loaded.set_aside] == [
        (first.test_id, ["path_outside_campaign"])
    ]
    assert [(p.kind, p.what, p.file) for p in loaded.problems if p.kind == "link"] == [
        ("link", LEADS_OUT, "raw/unlisted")
    ]
    assert not {first.file, "raw/unlisted"} & set(input_names(campaign))
    assert "secret" not in "".join([*map(str, loaded.problems), *input_names(campaign)])


def test_links_that_stay_within_the_campaign_are_followed(campaign: Path) -> None:
    before = load_campaign(campaign)
    (campaign / "raw").rename(campaign / "exports")
    (campaign / "raw").symlink_to("exports", target_is_directory=True)
    (campaign / "tests.csv").rename(campaign / "exports" / "list.csv")
    (campaign / "tests.csv").symlink_to("raw/list.csv")
    assert load_campaign(campaign).tests == before.tests
    assert {"tests.csv", before.tests[0].file} <= set(input_names(campaign))


def test_links_in_a_circle_end(campaign: Path) -> None:
    put_link(campaign / "tests.csv", Path("tests.csv"))
    assert not leads_out(campaign, campaign / "tests.csv")
    with pytest.raises((CampaignError, OSError)):
        load_campaign(campaign)


def test_overrides_that_are_a_link_out_of_their_folder_are_refused(campaign: Path, elsewhere: Path) -> None:
    put_link(campaign / "overrides.csv", elsewhere / "secret-file.csv")
    ingested = stages.ingest(load_campaign(campaign))
    with pytest.raises(TriboError, match="is not followed") as caught:
        apply_overrides(ingested, campaign / "overrides.csv", "first_peak")
    assert "secret" not in str(caught.value)


def everything_said(drop: Path) -> Iterator[str]:
    for found in scan(drop, 0.0):
        yield from (str(found.name), *found.files, *found.files.values(), *found.waiting)


def test_a_campaign_of_a_drop_folder_that_is_a_link_is_not_looked_into(campaign: Path, elsewhere: Path) -> None:
    drop = campaign.parent
    (drop / "other").symlink_to(elsewhere)
    shutil.make_archive(str(elsewhere / "secret"), "zip", campaign)
    (drop / "packed.zip").symlink_to(elsewhere / "secret.zip")
    put_link(drop / "campaign.overrides.csv", elsewhere / "secret-file.csv")
    found = {d.name: (d.waiting, d.overrides) for d in scan(drop, 0.0)}
    assert found == {
        "campaign": ((f"campaign.overrides.csv is {LEADS_OUT}",), None),
        "other": ((LEADS_OUT,), None),
        "packed": ((LEADS_OUT,), None),
    }
    assert "secret" not in "".join(everything_said(drop))


@pytest.mark.parametrize("target", ["nothing", "astray"])
def test_a_link_of_a_drop_folder_that_leads_nowhere_is_refused_and_stops_no_build(tmp_path: Path, target: str) -> None:
    """To something that is not there, and to itself."""
    drop = tmp_path / "drop"
    drop.mkdir()
    (drop / "astray").symlink_to(target)
    (looked_at,) = scan(drop, 0.0)
    assert (looked_at.name, looked_at.refused) == ("astray", (LEADS_NOWHERE,))
    assert place_problems(tmp_path / "site", (drop, drop / "astray")) == []


def test_a_link_of_a_drop_folder_to_a_pipe_or_a_device_has_a_row_of_its_own(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / ".pipe")
    (tmp_path / "device").symlink_to("/dev/zero")
    (tmp_path / "piped").symlink_to(".pipe")
    assert {d.name: (d.waiting, d.refused) for d in scan(tmp_path, 0.0)} == {
        "device": ((LEADS_OUT,), ()),
        "piped": ((), (LEADS_NOWHERE,)),
    }


def test_files_behind_links_of_a_campaign_in_a_drop_folder_are_not_hashed(campaign: Path, elsewhere: Path) -> None:
    put_link(campaign / "raw", elsewhere)
    (campaign / "more").symlink_to(elsewhere / "secret-file.csv")
    said = set(everything_said(campaign.parent))
    assert {"raw", "more"} <= said
    assert not {file_hash(p) for p in elsewhere.iterdir()} & said
    assert not any("secret" in text for text in said)


def test_a_forged_record_does_not_make_verify_read_outside_the_campaign(campaign: Path, elsewhere: Path) -> None:
    out = campaign.parent.parent / "out"
    out.mkdir()
    digest = file_hash(elsewhere / "secret-file.csv")
    names = ["../../elsewhere/secret-file.csv", str(elsewhere / "secret-file.csv"), "raw/link"]
    (campaign / "raw" / "link").symlink_to(elsewhere / "secret-file.csv")
    inputs = ", ".join(f'"{name}": "{digest}"' for name in names)
    record = f'{{"campaign": "../drop/campaign", "inputs": {{{inputs}}}, "outputs": {{}}, "options": {{}}, '
    record += '"versions": {}, "inputs_sha256": ""}'
    (out / "provenance.json").write_text(record)
    found = {d.file: d.status for d in verify(out).differences}
    assert {name: found.get(name) for name in names} == dict.fromkeys(names, "missing")
