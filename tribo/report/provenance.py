"""Where a result comes from: command, time, versions, seed, options, and the hash of every input and output."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from hashlib import file_digest, sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from tribo.display import displayed
from tribo.errors import naming
from tribo.files import leads_out, paths_below, text_of
from tribo.outputs import product, write as write_output
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
