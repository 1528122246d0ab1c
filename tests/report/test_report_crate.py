"""The study described for machines: files with their hashes, what made them, and the tribosystem in known terms."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256

from rocrate.rocrate import ROCrate

from report.conftest import Written
from tribo.records import Study
from tribo.report.crate import ONTOLOGY, conditions


def test_the_crate_is_read_by_its_own_library_and_names_every_file_with_its_hash(written: Written) -> None:
    crate = ROCrate(written.out)
    named = {entity.id: entity for entity in crate.get_entities() if entity.type == "File"}
    there = {p.relative_to(written.out).as_posix() for p in written.out.rglob("*") if p.is_file()}
    assert set(named) == there - {"provenance.json", "ro-crate-metadata.json"}
    for name, entity in named.items():
        assert entity["sha256"] == sha256((written.out / name).read_bytes()).hexdigest()


def test_the_run_joins_inputs_tool_and_results(written: Written) -> None:
    crate = ROCrate(written.out)
    run = crate.get("#run")
    assert run.type == "CreateAction"
    assert run["instrument"]["name"] == "tribo"
    assert run["description"].startswith("tribo report")
    assert {thing.id for thing in run["object"]} >= {"#campaign", "#parameter-seed", "#parameter-rule"}
    assert "report.pdf" in {thing.id for thing in run["result"]}


def test_the_tribosystem_stands_in_the_crate_with_terms_of_the_ontology(written: Written, study: Study) -> None:
    told = ROCrate(written.out).get("#tribosystem")["additionalProperty"]
    assert [t["name"] for t in told] == [c.name for c in conditions(study)]
    load = next(t for t in told if t["name"] == "Normal load")
    assert load["propertyID"] == f"{ONTOLOGY}NormalLoadSetpoint"
    assert (load["value"], load["unitText"]) == ("0.0637 to 1.37", "N")


def test_conditions_are_those_of_the_tests_that_were_used(study: Study) -> None:
    found = {c.name: c for c in conditions(study)}
    assert found["Moving body, material"].value == "PDMS"
    assert found["Number of tests"].value == "107"
    assert found["Tests per sample and load"].value == "2 to 3"
    assert found["Speed"].in_words == "0.200 mm/s"
    assert "circle 10 µm, pitch 15 µm, AF = 0.651" in found["Surface geometry"].value
    assert found["Test geometry"].value == "flat on flat, sled pulled over the counterface"
    assert found["Motion"].value == "linear, one way"


def test_what_was_not_recorded_is_said_to_be_so(study: Study) -> None:
    bare = tuple(replace(t, temperature_C=None, hold_s=None, operator="") for t in study.ingested.campaign.tests)
    campaign = replace(study.ingested.campaign, tests=bare, counterface="")
    found = {c.name: c for c in conditions(replace(study, ingested=replace(study.ingested, campaign=campaign)))}
    unsaid = ("Temperature", "Hold time before the pull", "Operator", "Counterface, material", "Lubrication")
    for name in unsaid:
        assert found[name].in_words == "not recorded"


def test_a_specimen_pulled_in_two_directions_counts_once(study: Study) -> None:
    """The same campaign, with the specimens of Sx pulled along y as well in place of three of their own."""
    campaign = study.ingested.campaign
    both = tuple(replace(t, specimen=t.specimen.replace("Sy", "Sx")) for t in campaign.tests)
    turned = replace(study, ingested=replace(study.ingested, campaign=replace(campaign, tests=both)))
    before, after = (next(c.value for c in conditions(s) if c.name == "Specimens") for s in (study, turned))
    assert (before, after) == ("18 specimens", "15 specimens")
