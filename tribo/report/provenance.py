"""Where a result comes from: command, time, versions, seed, options, and the hash of every input and output.

A report is verified by it: every input and output file is checked against the hash recorded in provenance.json.
"""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from hashlib import file_digest, sha256
from html import unescape
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

from tribo.comparison.prediction import kept_faults
from tribo.display import displayed
from tribo.errors import CampaignError, Problem, naming
from tribo.files import bytes_of, found_below, leads_out, paths_below, text_of
from tribo.input_files import opened_zip, pieces
from tribo.outputs import is_product, product, write as write_output
from tribo.own_folder import KEPT, MARK
from tribo.records import Study
from tribo.user_text import well_formed

FILE = "provenance.json"
PACKAGES = (
    "tribo", "numpy", "scipy", "pandas", "matplotlib", "xarray", "h5netcdf", "h5py", "numba", "statsmodels", "typst",
    "rocrate",
)  # fmt: skip
DESCRIBED_IN = ("campaign.toml", "tests.csv")
RAW = "raw"
OVERRIDES = "--overrides"  # the table of manual decisions, among the inputs of a campaign
OPTIONS = {"rule": "Rule", "weights": "Weights", "flat": "Flat sample", "runs": "Simulations per load"}


@displayed()
@dataclass(frozen=True)
class Provenance:
    """How a report was made. ``inputs`` maps each file of the campaign, by its path in it, to its SHA-256.

    ``campaign`` is where the campaign was, ``overrides`` the path and SHA-256 of the table of manual decisions, if
    one was given.
    """

    command: str = ""
    started_at: str = ""
    seed: int | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    inputs: Mapping[str, str] = field(default_factory=dict)
    campaign: str = ""
    overrides: Mapping[str, str] = field(default_factory=dict)

    @property
    def inputs_digest(self) -> str:
        """One SHA-256 over the names and hashes of all inputs, the overrides among them."""
        hashes = {**self.inputs, **({OVERRIDES: self.overrides["sha256"]} if self.overrides else {})}
        listing = "".join(f"{digest}  {name}\n" for name, digest in sorted(hashes.items()))
        return sha256(listing.encode()).hexdigest()

    @property
    def origin(self) -> str:
        """Everything that determines the numbers, in one line: the same for the same inputs at any time and place."""
        chosen = {"seed": self.seed, **self.options}
        return "; ".join(
            [
                f"tribo {self.versions.get('tribo', '')}".rstrip(),
                f"inputs SHA-256 {self.inputs_digest}",
                *(f"{name} {value}" for name, value in chosen.items() if value is not None),
            ]
        )

    def in_words(self) -> list[tuple[str, str]]:
        """Names and values as a report shows them."""
        chosen = {OPTIONS.get(name, name.replace("_", " ")): str(value) for name, value in self.options.items()}
        overrides = f"{self.overrides['file']}, SHA-256 {self.overrides['sha256']}" if self.overrides else ""
        known = {
            "Command": self.command,
            "Started": self.started_at,
            "Seed": "" if self.seed is None else str(self.seed),
            **chosen,
            "Versions": ", ".join(f"{name} {number}" for name, number in self.versions.items()),
            "Inputs": f"{len(self.inputs)} files, combined SHA-256 of their names and hashes {self.inputs_digest}",
            "Overrides": overrides,
        }
        return [(name, value) for name, value in known.items() if value]

    def as_record(self) -> dict[str, Any]:
        """Plain types, as provenance.json and campaign.nc hold them."""
        return {**asdict(self), "inputs_sha256": self.inputs_digest}


def gather_provenance(
    study: Study,
    command: str = "",
    seed: int | None = None,
    started_at: str = "",
    options: Mapping[str, Any] | None = None,
    campaign: Path | None = None,
    overrides: Path | None = None,
) -> Provenance:
    """Versions of the software, and hashes of all files of the campaign: those read as they were when they were read.

    ``campaign`` is the folder or .zip as the user gave it, ``overrides`` the table of manual decisions.
    """
    root, read = study.ingested.campaign.root, dict(study.ingested.campaign.inputs)
    decided = {}
    if overrides is not None:
        decided = {"file": str(overrides), "sha256": read.pop(OVERRIDES, "") or file_hash(overrides)}
    inputs = {}
    for name in dict.fromkeys((*input_names(root), *sorted(read))):
        if name in read or (root / name).is_file():
            inputs[well_formed(name)] = read.get(name) or file_hash(root / name)
    where = str(campaign or root)
    return Provenance(command, started_at, seed, dict(options or {}), _versions(), inputs, where, decided)


def provenance_of_table(
    folder: Path, names: Iterable[str], command: str = "", seed: int | None = None, started_at: str = ""
) -> Provenance:
    """The same for a published table in place of a campaign: the files ``names`` of a folder."""
    inputs = {name: file_hash(folder / name) for name in names}
    return Provenance(command, started_at, seed, {}, _versions(), inputs, str(folder))


def provenance_of_comparison(folders: tuple[Path, Path], command: str = "", started_at: str = "") -> Provenance:
    """The same for two folders of results; their files are named FOLDER/FILE, from the folder that holds both."""
    root = Path(os.path.commonpath([folder.resolve() for folder in folders]))
    names = ("fits.csv", "tests.csv", "card.json", "verdict.json")
    files = [folder.resolve() / name for folder in folders for name in names if (folder / name).is_file()]
    inputs = {well_formed(path.relative_to(root).as_posix()): file_hash(path) for path in files}
    return Provenance(command, started_at, None, {}, _versions(), inputs, str(root))


def input_names(root: Path) -> Iterator[str]:
    """What a campaign folder holds: its two tables and every file of raw/, in order; no links that lead out of it."""
    yield from (name for name in DESCRIBED_IN if (root / name).is_file() and not leads_out(root, root / name))
    below = paths_below(root, RAW)
    yield from (path.relative_to(root).as_posix() for path, outward in below if not outward and path.is_file())


def _versions() -> dict[str, str]:
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def file_hash(path: Path) -> str:
    """SHA-256 of a file."""
    with naming(path), path.open("rb") as stream:
        return file_digest(stream, "sha256").hexdigest()


def write_provenance(provenance: Provenance, out: Path, outputs: Mapping[str, str] | None = None) -> Path:
    """Write out/provenance.json; ``outputs`` maps each file of OUT to its SHA-256.

    Places are written relative to OUT, so that a study that is moved as a whole can still be verified.
    """
    record = provenance.as_record()
    record["campaign"] = _from(out, provenance.campaign)
    if provenance.overrides:
        record["overrides"] = {**provenance.overrides, "file": _from(out, provenance.overrides["file"])}
    record["origin"] = provenance.origin
    record["outputs"] = dict(sorted((outputs or {}).items()))
    return write_output(out, FILE, json.dumps(record, indent=1, ensure_ascii=False, default=str) + "\n")


def _from(out: Path, place: str) -> str:
    if not place:
        return ""
    try:
        return Path(os.path.relpath(place, out)).as_posix()
    except ValueError:  # another drive
        return str(Path(place).absolute())


def read_record(out: Path) -> dict[str, Any] | None:
    """The contents of provenance.json of a folder; None if there is none, or none of this kind.

    Raises
    ------
    OSError
        It is there and cannot be read.
    """
    try:
        record = json.loads(text_of(out / FILE))
    except (FileNotFoundError, NotADirectoryError, ValueError, RecursionError):
        return None
    return record if isinstance(record, dict) and _is_whole(record) else None


def _is_whole(record: Mapping[str, Any]) -> bool:
    """Whether a record has every part that is read from it, each of its kind."""
    texts = [record.get("inputs_sha256"), record.get("campaign", "")]
    tables = [record.get(name) for name in ("inputs", "outputs", "options", "versions")]
    overrides = record.get("overrides") or {}
    return (
        all(isinstance(text, str) and "\0" not in text for text in texts)
        and all(isinstance(table, dict) for table in tables)
        and all(isinstance(t, str) and "\0" not in n for name in ("inputs", "outputs") for n, t in record[name].items())
        and isinstance(overrides, dict)
        and (not overrides or all(isinstance(overrides.get(key), str) for key in ("file", "sha256")))
        and isinstance(record.get("seed"), int | None)
    )


def write_results(contents: Mapping[str, Any], out: Path, provenance: Provenance, stage: str) -> None:
    """All files of a command by name, and provenance.json with the hash of each; files of an earlier run are removed.

    ``contents`` and ``stage`` are those of :func:`tribo.outputs.write`.
    """
    before = read_record(out)
    written = [write_output(out, name, content, stage) for name, content in contents.items()]
    write_provenance(provenance, out, settle_outputs(out, before, provenance, written, complete=True))


def settle_outputs(
    out: Path, before: Mapping[str, Any] | None, provenance: Provenance, written: Iterable[Path], complete: bool
) -> dict[str, str]:
    """The files that belong to this record, with their hashes; those of an earlier record that do not are removed.

    An earlier file stays where its run had the same inputs and choices and this run did not write everything itself
    (``complete``). A file that someone changed since is never removed.

    Raises
    ------
    LookupError
        A file was written that :mod:`tribo.outputs` does not state.
    """
    stands = before is not None and not complete and same_origin(before, provenance)
    outputs = {path.relative_to(out).as_posix(): file_hash(path) for path in written}
    for name in outputs:
        product(name)
    for name, digest in (before or {}).get("outputs", {}).items():
        path = out / name
        if name in outputs or not path.resolve().is_relative_to(out.resolve()) or not path.is_file():
            continue
        if stands:
            outputs[name] = digest
        elif file_hash(path) == digest:
            path.unlink()
    return outputs


def same_origin(before: Mapping[str, Any], provenance: Provenance) -> bool:
    """Whether an earlier run had the same inputs and version, and made the same choices where it had to choose."""
    earlier, now = before["options"], provenance.options
    return (
        before["inputs_sha256"] == provenance.inputs_digest
        and before["versions"].get("tribo") == provenance.versions.get("tribo")
        and (None in (before["seed"], provenance.seed) or before["seed"] == provenance.seed)
        and all(str(earlier[name]) == str(now[name]) for name in earlier.keys() & now.keys())
    )


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
        if not (campaign / DESCRIBED_IN[0]).is_file():
            below = sorted(p.parent for p in found_below(campaign, DESCRIBED_IN[0]))
            root = below[0] if len(below) == 1 else campaign
        names = list(dict.fromkeys((*input_names(root), *recorded)))
    for name in names:
        if not leads_out(root, root / name) and (root / name).is_file():
            yield well_formed(name), file_hash(root / name)


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
