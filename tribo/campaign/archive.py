"""A campaign in a folder or in a .zip that is not trusted."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tribo.campaign.load import TOML, load_campaign
from tribo.errors import CampaignError, Problem
from tribo.records import Campaign
from tribo.temporary import temporary_folder
from tribo.zips import unpack


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
        with temporary_folder() as folder:
            unpack(path, folder)
            yield load_campaign(_campaign_folder(folder, path.name), measured=measured)
    else:
        raise CampaignError(Problem("missing", "this folder or .zip does not exist", file=str(path)))


def _campaign_folder(folder: Path, shown: str) -> Path:
    """The folder itself if it holds campaign.toml, else the one folder below that does."""
    if (folder / TOML).is_file():
        return folder
    found = sorted(p.parent for p in folder.rglob(TOML) if p.is_file() and "__MACOSX" not in p.parts)
    if len(found) == 1:
        return found[0]
    if not found:
        raise CampaignError(Problem("missing_file", f"no {TOML} in this folder", file=shown))
    names = ", ".join(p.relative_to(folder).as_posix() for p in found)
    raise CampaignError(Problem("several_campaigns", f"more than one {TOML} in it", file=shown, found=names))
