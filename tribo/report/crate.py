"""ro-crate-metadata.json: a study described for machines, after RO-Crate and its profile for the run of a process."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from tribo.records import Study
from tribo.report.provenance import Provenance, file_hash
from tribo.report.tribosystem import Condition, conditions
from tribo.store.whole_files import write_text

FILE = "ro-crate-metadata.json"
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
MEDIA_TYPES = {
    ".csv": "text/csv", ".html": "text/html", ".json": "application/json", ".nc": "application/x-hdf5",
    ".pdf": "application/pdf", ".png": "image/png", ".svg": "image/svg+xml",
}  # fmt: skip
UNDATED = "1970-01-01"


def write_crate(study: Study, out: Path, provenance: Provenance, written: Iterable[Path]) -> Path:
    """Write out/ro-crate-metadata.json over the files ``written``: their types and hashes, and how they were made.

    It includes the tribosystem as required by ASTM G115, with terms of the TriboDataFAIR ontology where they exist.
    """
    record = crate_record(study, out, provenance, written)
    return write_text(out / FILE, json.dumps(record, indent=1, ensure_ascii=False) + "\n")


def crate_record(study: Study, out: Path, provenance: Provenance, written: Iterable[Path]) -> dict[str, Any]:
    """The crate as JSON-LD."""
    from rocrate.model.contextentity import ContextEntity
    from rocrate.rocrate import ROCrate

    crate = ROCrate()
    campaign = study.ingested.campaign
    crate.name = campaign.title
    crate.description = f"Friction report: measured pulls, fitted laws, model and diagnosis of {campaign.title}."
    crate.root_dataset["datePublished"] = provenance.started_at or UNDATED
    crate.root_dataset["license"] = "not stated"

    def entity(identifier: str, properties: Mapping[str, Any]) -> Any:
        return crate.add(ContextEntity(crate, identifier, properties=dict(properties)))

    results = [
        crate.add_file(path, dest_path=path.relative_to(out).as_posix(), properties=_file_properties(path))
        for path in sorted(written)
    ]
    profile = entity(PROFILE, {"@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5"})
    crate.root_dataset["conformsTo"] = profile
    tool = entity("#tribo", {
        "@type": "SoftwareApplication", "name": "tribo", "version": provenance.versions.get("tribo", ""),
        "softwareRequirements": [f"{n} {v}" for n, v in provenance.versions.items() if n != "tribo"],
    })  # fmt: skip
    source = entity("#campaign", _campaign_properties(study, provenance))
    parameters = {"seed": provenance.seed, **provenance.options}
    chosen = [
        entity(f"#parameter-{name}", {"@type": "PropertyValue", "name": name, "value": str(value)})
        for name, value in parameters.items()
        if value is not None
    ]
    run = entity("#run", _run_properties(provenance))
    run["instrument"], run["object"], run["result"] = tool, [source, *chosen], results
    crate.root_dataset["mentions"] = run
    told = [entity(f"#condition-{k}", _condition_properties(c)) for k, c in enumerate(conditions(study), start=1)]
    system = entity("#tribosystem", {"@type": "Thing", "name": "tribosystem", "description":
                                     "Test conditions required by ASTM G115"})  # fmt: skip
    system["additionalProperty"] = told
    crate.root_dataset["about"] = system
    source["about"] = system
    record: dict[str, Any] = crate.metadata.generate()
    record["@graph"] = sorted(record["@graph"], key=lambda e: (e["@id"] not in (FILE, "./"), str(e["@id"])))
    return record


def _file_properties(path: Path) -> dict[str, Any]:
    return {
        "name": path.name,
        "encodingFormat": MEDIA_TYPES.get(path.suffix, "application/octet-stream"),
        "contentSize": str(path.stat().st_size),
        "sha256": file_hash(path),
    }


def _campaign_properties(study: Study, provenance: Provenance) -> dict[str, Any]:
    tests = study.ingested.campaign.tests
    return {
        "@type": "Dataset",
        "name": study.ingested.campaign.title,
        "description": f"Campaign of {len(tests)} tests, {len(provenance.inputs)} files; provenance.json holds the "
        "hash of each.",
        "identifier": f"sha256:{provenance.inputs_digest}",
    }


def _run_properties(provenance: Provenance) -> dict[str, Any]:
    told = {"description": provenance.command, "startTime": provenance.started_at}
    known = {"@type": "CreateAction", "name": "tribo", **told}
    return {name: value for name, value in known.items() if value}


def _condition_properties(condition: Condition) -> dict[str, Any]:
    known = {
        "@type": "PropertyValue",
        "name": condition.name,
        "value": condition.value,
        "unitText": condition.unit,
        "propertyID": condition.iri,
    }
    return {name: value for name, value in known.items() if value}
