"""Check every input and output file of a report against the hash recorded in provenance.json."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from html import unescape
from pathlib import Path
from typing import Any, Literal

from tribo.cache.own_folder import KEPT, MARK
from tribo.comparison.prediction import kept_faults
from tribo.display import displayed
from tribo.errors import CampaignError, Problem
from tribo.files import bytes_of, found_below, leads_out
from tribo.input_files import opened_zip, pieces
from tribo.outputs import is_product, product
from tribo.report.provenance import DESCRIBED_IN, FILE, RAW, file_hash, input_names, read_record
from tribo.user_text import well_formed

ORIGIN = "inputs SHA-256 "  # begins what determines the numbers of a file, to the end of its origin


@dataclass(frozen=True)
class Difference:
    """One file that differs from its record."""

    kind: Literal["input", "output"]
    status: Literal["changed", "missing", "added", "another run's"]
    file: str


@displayed()
@dataclass(frozen=True)
class Verification:
    """What was compared, and all differences."""

    campaign: str
    n_inputs: int
    n_outputs: int
    differences: tuple[Difference, ...]
    unfinished: bool = False  # a run that was to write here was killed or failed
    kept: Mapping[str, str] = field(default_factory=dict)  # kept results, with why each is not believed

    @property
    def unchanged(self) -> bool:
        return not self.differences and not self.unfinished

    def as_record(self) -> dict[str, Any]:
        return {**asdict(self), "unchanged": self.unchanged}

    def in_words(self) -> str:
        compared = f"{self.n_inputs} inputs and {self.n_outputs} outputs compared with {FILE}"
        doubted = [f"kept result {KEPT}/{name} {why}; it is not used" for name, why in self.kept.items() if why]
        believed = len(self.kept) - len(doubted)
        made_here = f"{believed} of {len(self.kept)} kept results were made by this user on this machine"
        kept = [*doubted, made_here] if self.kept else []
        if self.unchanged:
            return "\n".join([f"{compared}: no changes", *kept])
        lines = [f"{d.status} {d.kind}: {d.file}" for d in self.differences]
        ended = ["a run that was to write into this folder has not ended; start it again"] if self.unfinished else []
        differences = f"{len(lines)} difference{'' if len(lines) == 1 else 's'}"
        return "\n".join([f"{compared}: {differences}", *lines, *ended, *kept])


def verify(out: Path | str, campaign: Path | str | None = None) -> Verification:
    """Compare the files of a study with the hashes in its provenance.json.

    Parameters
    ----------
    out : Path or str
        Folder of results that a command or :func:`tribo.write_report` wrote.
    campaign : Path or str, optional
        Folder or .zip of the campaign, if it has been moved since.

    Returns
    -------
    Verification
        ``unchanged`` is true where every input and output is as recorded and the run has ended; ``differences`` name
        each file that was changed, added or removed, or that another run made. ``kept`` names every kept result, with
        why the next start would not use it; empty where this user has made it on this machine.

    Raises
    ------
    CampaignError
        There is no provenance.json in ``out``, or it lists no outputs; or the .zip of the campaign is refused
        (:func:`tribo.input_files.opened_zip`).
    OSError
        A file is there and cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import tribo
    >>> from tribo.report import write_until
    >>> study = tribo.study(tribo.load_campaign(tribo.data_dir() / "example"), until="ingest")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     out = Path(folder) / "out"
    ...     write_until(study, out, "ingest")
    ...     before = tribo.verify(out)
    ...     (out / "tests.csv").unlink()
    ...     after = tribo.verify(out)
    >>> before.unchanged
    True
    >>> [(found.status, found.file) for found in after.differences]
    [('missing', 'tests.csv')]
    """
    out = Path(out)
    record = read_record(out)
    if record is None:
        what = "this folder holds no record of inputs and outputs"
        if (out / FILE).is_file():
            what = "the record of inputs and outputs is damaged"
        raise CampaignError(Problem("no_provenance", what, file=str(out / FILE), allowed="an output folder of tribo"))
    place = Path(campaign) if campaign is not None else out / record["campaign"]
    recorded = dict(record["inputs"])
    found = dict(_input_hashes(place, recorded))
    overrides = record.get("overrides") or {}
    if overrides:
        recorded[overrides["file"]] = overrides["sha256"]
        path = out / overrides["file"]
        found |= {overrides["file"]: file_hash(path)} if path.is_file() else {}
    outputs = dict(_output_hashes(out))
    differences = (
        *_differences("input", recorded, found),
        *_differences("output", record["outputs"], outputs),
        *(Difference("output", "another run's", name) for name in of_other_runs(out, record) if name in outputs),
    )
    unfinished, kept = (out / MARK).exists(), kept_faults(out / KEPT)
    return Verification(str(place), len(recorded), len(record["outputs"]), differences, unfinished, kept)


def of_other_runs(out: Path, record: Mapping[str, Any]) -> Iterator[str]:
    """Outputs that name other inputs or options than the record: figures and tables of two runs that were mixed."""
    _, start, rest = str(record.get("origin", "")).partition(ORIGIN)
    for name in record["outputs"] if start else ():
        path = out / name
        if is_product(name) and path.suffix in product(name).origin_in and path.is_file():
            text = unescape(bytes_of(path).decode("utf-8", "replace"))
            if any(not part.startswith(rest) for part in text.split(ORIGIN)[1:]):
                yield name


def _differences(
    kind: Literal["input", "output"], recorded: Mapping[str, str], found: Mapping[str, str]
) -> Iterator[Difference]:
    for name in sorted({*recorded, *found}):
        if name not in found:
            yield Difference(kind, "missing", name)
        elif name not in recorded:
            yield Difference(kind, "added", name)
        elif found[name] != recorded[name]:
            yield Difference(kind, "changed", name)


def _input_hashes(campaign: Path, recorded: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Everything that counts as an input of a campaign folder or .zip, and whatever else was recorded as one."""
    if campaign.is_file():
        yield from _zipped_hashes(campaign, recorded)
        return
    root, names = campaign, list(recorded)
    if DESCRIBED_IN[0] in recorded:  # not so of two reports that were compared, whose folder may hold anything
        root = campaign if (campaign / DESCRIBED_IN[0]).is_file() else _only_campaign_below(campaign)
        names = list(dict.fromkeys((*input_names(root), *recorded)))
    for name in names:
        if not leads_out(root, root / name) and (root / name).is_file():
            yield well_formed(name), file_hash(root / name)


def _only_campaign_below(folder: Path) -> Path:
    found = sorted(p.parent for p in found_below(folder, DESCRIBED_IN[0]))
    return found[0] if len(found) == 1 else folder


def _zipped_hashes(archive: Path, recorded: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    with opened_zip(archive) as (opened, entries):
        files = {path: info for path, info in entries.items() if not path.endswith("/")}
        tomls = [path for path in files if path.rpartition("/")[2] == DESCRIBED_IN[0]]
        base = tomls[0].removesuffix(DESCRIBED_IN[0]) if len(tomls) == 1 else ""
        for path, info in files.items():
            inside = path.removeprefix(base)
            if inside in DESCRIBED_IN or inside.startswith(f"{RAW}/") or inside in recorded:
                digest = sha256()
                for piece in pieces(opened, info, archive.name):
                    digest.update(piece)
                yield inside, digest.hexdigest()


def _output_hashes(out: Path) -> Iterator[tuple[str, str]]:
    """Every file of OUT but the record itself, what is hidden, and what is kept for the next start."""
    for path in found_below(out):
        inside = path.relative_to(out)
        hidden = any(part.startswith(".") for part in inside.parts)
        if path.is_file() and not hidden and inside.parts[0] != KEPT and inside.as_posix() != FILE:
            yield inside.as_posix(), file_hash(path)
