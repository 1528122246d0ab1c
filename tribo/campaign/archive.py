"""A campaign in a folder or in a .zip that is not trusted."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tribo.campaign.load import TOML, load_campaign
from tribo.campaign.table import RAW, TABLES
from tribo.errors import CampaignError, Problem
from tribo.file_contents import found_below
from tribo.nearest import did_you_mean, nearest
from tribo.records import Campaign
from tribo.temporary import temporary_folder
from tribo.zips import unpack

_TABLES_OF_EXPORTS = (".csv", ".txt", ".tsv", ".dat", ".xlsx", ".xls", ".ods", ".tra", ".mat", ".tdms")


@contextmanager
def open_campaign(path: Path | str, *, measured: bool = True) -> Iterator[Campaign]:
    """Open a campaign folder, or a .zip that holds one (unpacked into a temporary folder while it is open).

    ``measured`` as in :func:`tribo.campaign.load_campaign`.

    Raises
    ------
    CampaignError
        The campaign is unusable; or the archive is refused (:func:`tribo.zips.opened_zip`), or contains no
        campaign.toml, or more than one.
    """
    path = Path(path)
    if path.is_dir():
        yield load_campaign(_campaign_folder(path, path.name), measured=measured)
    elif path.is_file():
        _refuse_a_file_of_a_campaign(path)
        with temporary_folder() as folder:
            unpack(path, folder)
            yield load_campaign(_campaign_folder(folder, path.name), measured=measured)
    else:
        beside = [p.name for p in path.parent.iterdir()] if path.parent.is_dir() else []
        allowed = did_you_mean(path.name, beside) or None
        raise CampaignError(Problem("missing", "this folder or .zip does not exist", file=str(path), allowed=allowed))


def _refuse_a_file_of_a_campaign(path: Path) -> None:
    """Raises CampaignError where a file of a campaign, or an export, is given in place of the folder."""
    if path.suffix.lower() == ".zip":
        return
    if path.name in (TOML, *TABLES) or (path.parent / TOML).is_file():
        what, folder = "this is a file of a campaign; give the folder", path.parent
    elif path.parent.name == RAW and (path.parent.parent / TOML).is_file():
        what, folder = "this is an export of a campaign; give the folder", path.parent.parent
    elif path.suffix.lower() in _TABLES_OF_EXPORTS:
        what = "this is neither a campaign folder nor a .zip of one; an export alone is no campaign"
        allowed = f"tribo inspect {path} shows what is in it; tribo init NEW --from {path.parent} makes a campaign"
        raise CampaignError(Problem("not_a_campaign", what, file=str(path), allowed=allowed))
    else:
        return
    raise CampaignError(Problem("file_of_a_campaign", what, file=str(path), allowed=str(folder)))


def _campaign_folder(folder: Path, shown: str) -> Path:
    """The folder itself if it holds campaign.toml, else the one folder below that does."""
    if (folder / TOML).is_file():
        return folder
    found = sorted(p.parent for p in found_below(folder, TOML) if p.is_file() and "__MACOSX" not in p.parts)
    if len(found) == 1:
        return found[0]
    if not found:
        raise CampaignError(Problem("missing_file", f"no {TOML} in this folder", shown, allowed=_instead(folder)))
    names = ", ".join(p.relative_to(folder).as_posix() for p in found)
    raise CampaignError(Problem("several_campaigns", f"more than one {TOML} in it", file=shown, found=names))


def _instead(folder: Path) -> str:
    """What to do about a folder without campaign.toml."""
    names = sorted(path.name for path in folder.iterdir() if path.is_file())
    near = next((n for n in names if n.casefold().startswith(TOML)), "") or nearest(TOML, names, 0.75)
    if near:
        return f"{TOML}; rename {near}?"
    if not names:
        return f"{TOML}, {TABLES[0]} and {RAW}/; tribo init writes them into a new folder"
    return f"{TOML}, {TABLES[0]} and {RAW}/; for a folder of exports: tribo init NEW --from {folder.name}"
