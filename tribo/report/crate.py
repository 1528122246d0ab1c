"""The tribosystem of a campaign, and ro-crate-metadata.json, which describes a study for machines.

The tribosystem are the conditions that ASTM G115 requires with a friction coefficient. Where the TriboDataFAIR ontology
(Garabedian et al. 2022, Scientific Data 9, 315) has a term, it is given with the condition. A condition that the
campaign does not record is stated as not recorded and never guessed. The crate follows RO-Crate and its profile for the
run of a process.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tribo.comparison import findings
from tribo.records import PA_PER_KPA, Campaign, Pattern, Study, Test
from tribo.report.provenance import Provenance, file_hash
from tribo.wording.numerals import counted, joined, significant
from tribo.wording.study_sentences import specimens_of

ONTOLOGY = "https://raw.githubusercontent.com/nick-garabedian/TriboDataFAIR-Ontology/v0.1.1/TriboDataFAIR_Ontology.owl#"
NOT_RECORDED = "not recorded"


@dataclass(frozen=True)
class Condition:
    """One condition of the tribosystem in words; ``unit`` where the value is numbers, ``term`` where one exists."""

    name: str
    value: str
    unit: str = ""
    term: str = ""

    @property
    def iri(self) -> str:
        return ONTOLOGY + self.term if self.term else ""

    @property
    def in_words(self) -> str:
        return self.value if self.value == NOT_RECORDED else f"{self.value} {self.unit}".rstrip()


def conditions(study: Study) -> list[Condition]:
    """The conditions of the tests that were used, in the order of ASTM G115: bodies, contact, motion, surroundings."""
    campaign = study.ingested.campaign
    tests = list(study.ingested.used_tests)
    return [*_bodies(study, tests), *_contact(campaign, tests), *_motion(campaign, tests), *_surroundings(tests)]


def _bodies(study: Study, tests: list[Test]) -> Iterator[Condition]:
    campaign = study.ingested.campaign
    samples = findings.tested_samples(study)
    yield Condition("Moving body, material", campaign.material or NOT_RECORDED, term="MaterialName")
    yield Condition("Counterface, material", campaign.counterface or NOT_RECORDED, term="MaterialName")
    yield Condition("Surface geometry", "; ".join(f"{s}: {_geometry(campaign.samples[s])}" for s in samples))
    yield Condition("Surface roughness and preparation", NOT_RECORDED)
    specimens = len(specimens_of(campaign, tests))
    yield Condition("Specimens", counted(specimens, "specimen"), term="BlockSpecimen")


def _geometry(pattern: Pattern) -> str:
    if pattern.cavity == "none" or pattern.size_m is None or pattern.pitch_m is None:
        return "flat"
    size, pitch = ([v * 1e6 for v in pair] for pair in (pattern.size_m, pattern.pitch_m))
    sides = size[:1] if pattern.cavity in ("circle", "square", "ridge") else size
    steps = pitch[:1] if pitch[0] == pitch[1] else pitch
    shape = f"{pattern.cavity} {' × '.join(f'{v:.4g}' for v in sides)} µm"
    shape = f"pillars, {shape}" if pattern.feature == "pillar" else shape
    staggered = ", staggered" if pattern.staggered else ""
    return f"{shape}, pitch {' × '.join(f'{v:.4g}' for v in steps)} µm{staggered}, AF = {pattern.area_fraction:.3f}"


SLED = "sled"
GEOMETRIES = {
    SLED: "flat on flat, sled pulled over the counterface", "pin_on_disc": "pin on disc",
    "ball_on_disc": "ball on disc", "ring_shear": "ring shear tester", "reciprocating": "reciprocating",
    "rotary": "rotary",
}  # fmt: skip
MOTIONS = {SLED: "linear, one way", "reciprocating": "reciprocating"}  # the others turn


def _rig(campaign: Campaign) -> str:
    """The kind of contact: as stated; that of the spring-block model where samples have patterns; else empty."""
    patterned = any(not pattern.is_flat for pattern in campaign.samples.values())
    return campaign.contact or (SLED if patterned else "")


def _contact(campaign: Campaign, tests: list[Test]) -> Iterator[Condition]:
    loads = np.array([t.normal_load_N for t in tests])
    yield Condition("Test geometry", GEOMETRIES.get(_rig(campaign), NOT_RECORDED))
    if campaign.has_area:
        yield Condition("Nominal contact area", f"{campaign.area_m2 * 1e6:g}", "mm²")
    yield Condition("Normal load", _range(loads), "N", "NormalLoadSetpoint")
    if campaign.has_area:
        yield Condition("Nominal pressure", _range(loads / campaign.area_m2 / PA_PER_KPA), "kPa")
    if campaign.slider_mass_kg:
        yield Condition("Load applied by", "dead weight", term="DeadWeightLoadApplication")
    yield Condition("Lubrication", NOT_RECORDED, term="InterfacialMediumCategory")


def _motion(campaign: Campaign, tests: list[Test]) -> Iterator[Condition]:
    speeds = [t.speed_m_s if t.speed_m_s is not None else campaign.pull_speed_m_s for t in tests]
    directions = sorted({t.direction for t in tests if t.direction})
    rig = _rig(campaign)
    term = "UnidirectionalLinearMotion" if rig == SLED else ""
    yield Condition("Motion", MOTIONS.get(rig, "rotation") if rig else NOT_RECORDED, term=term)
    yield Condition("Speed", _range(_known(speeds) * 1e3), "mm/s", "SlidingSpeedSetpoint")
    yield Condition("Hold time before the pull", _range(_known(t.hold_s for t in tests)), "s", "LoadRelaxationSetpoint")
    yield Condition("Pull direction", joined(directions) or NOT_RECORDED)
    yield Condition("Number of tests", str(len(tests)))
    yield Condition("Tests per sample and load", _repeats(tests))


def _surroundings(tests: list[Test]) -> Iterator[Condition]:
    temperature = _range(_known(t.temperature_C for t in tests))
    humidity = _range(_known(t.humidity_pct for t in tests))
    days = sorted(t.started_at for t in tests if t.started_at)
    yield Condition("Temperature", temperature, "°C", "UncontrolledEnvironmentTemperature")
    yield Condition("Relative humidity", humidity, "%", "UncontrolledEnvironmentRelativeHumidity")
    yield Condition("Measured on", f"{days[0]} to {days[-1]}" if days else NOT_RECORDED, term="ProcessStartTime")
    operators = sorted({t.operator for t in tests if t.operator})
    yield Condition("Operator", joined(operators) or NOT_RECORDED)


def _known(values: Iterable[float | None]) -> np.ndarray:
    return np.array([v for v in values if v is not None], float)


def _range(values: np.ndarray) -> str:
    """ "0.0638 to 1.37", one number where all are alike, "not recorded" where there are none."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return NOT_RECORDED
    low, high = significant(float(finite.min())), significant(float(finite.max()))
    return low if low == high else f"{low} to {high}"


def _repeats(tests: list[Test]) -> str:
    if not tests:
        return "0"
    levels = findings.load_levels(np.array([t.normal_load_N for t in tests]))
    cells: dict[tuple[str, float], int] = {}
    for test, level in zip(tests, levels.tolist(), strict=True):
        cells[test.sample, level] = cells.get((test.sample, level), 0) + 1
    fewest, most = min(cells.values()), max(cells.values())
    return str(most) if fewest == most else f"{fewest} to {most}"


FILE = "ro-crate-metadata.json"
PROFILE = "https://w3id.org/ro/wfrun/process/0.5"
MEDIA_TYPES = {
    ".csv": "text/csv", ".html": "text/html", ".json": "application/json", ".nc": "application/x-hdf5",
    ".pdf": "application/pdf", ".png": "image/png", ".svg": "image/svg+xml",
}  # fmt: skip
UNDATED = "1970-01-01"


def crate_text(study: Study, out: Path, provenance: Provenance, written: Iterable[Path]) -> str:
    """ro-crate-metadata.json over the files ``written``: their types and hashes, and how they were made.

    It includes the tribosystem as required by ASTM G115, with terms of the TriboDataFAIR ontology where they exist.
    """
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
    return json.dumps(record, indent=1, ensure_ascii=False) + "\n"


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
