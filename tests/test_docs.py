"""Every public name has an entry in the reference, and every entry and every link leads somewhere."""

from __future__ import annotations

import doctest
import inspect
import re
import shutil
import textwrap
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import tribo
from tribo.mechanisms import MECHANISMS
from tribo.records import Campaign, Ingested
from tribo.stages import ingest as real_ingest
from tribo.wording.numerals import sentence_case

DOCS = Path(__file__).resolve().parents[1] / "docs"
PACKAGES = sorted(file.parent.name for file in Path(tribo.__file__).parent.glob("*/__init__.py"))
REFERENCE = sorted((DOCS / "reference").glob("*.md"))
RECORDS = ("records", "fits", "errors")
DIRECTIVE = re.compile(r"^\.\. auto(function|class|data|module|exception):: (\S+)", re.MULTILINE)
EXPLAINED = [name for name in tribo.__all__ if callable(getattr(tribo, name)) and name != "diagnosis"]  # an old name
LINK = re.compile(r"\]\((?!https?:|#)([^)#\s]+)(?:#[^)]*)?\)")


def object_of(name: str) -> Any:
    """The module or the member of a module that a dotted name stands for."""
    module, _, member = name.rpartition(".")
    found = getattr(import_module(module), member, None)
    return import_module(name) if found is None or isinstance(found, ModuleType) else found


def entries() -> dict[str, str]:
    """Dotted name -> kind of every directive of the reference pages."""
    texts = (page.read_text(encoding="utf-8") for page in REFERENCE)
    return {name: kind for text in texts for kind, name in DIRECTIVE.findall(text)}


def public_names() -> list[str]:
    """Names that users meet: of tribo, of its packages, and every record and error."""
    names = [f"tribo.{name}" for name in tribo.__all__]
    for package in PACKAGES:
        names += [f"tribo.{package}.{name}" for name in getattr(import_module(f"tribo.{package}"), "__all__", ())]
    for module in RECORDS:
        members = vars(import_module(f"tribo.{module}")).items()
        names += [
            f"tribo.{module}.{name}"
            for name, member in members
            if isinstance(member, type) and member.__module__ == f"tribo.{module}"
        ]
    return names


def documented() -> list[Any]:
    """The objects of all entries; of a module, also its classes."""
    found = []
    for name, kind in entries().items():
        here = object_of(name)
        found.append(here)
        if kind == "module":
            found += [m for m in vars(here).values() if isinstance(m, type) and m.__module__ == name]
    return found


@pytest.mark.parametrize("name", public_names())
def test_a_public_name_has_an_entry_in_the_reference(name: str) -> None:
    wanted = object_of(name)
    assert any(here is wanted for here in documented())


def sections_of(name: str) -> dict[str, str]:
    """Heading -> text of the numpy sections that explain a public name."""
    parts = re.split(r"^(\w+)\n-+\n", inspect.getdoc(getattr(tribo, name)) or "", flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.parametrize("name", EXPLAINED)
def test_a_public_name_explains_what_it_takes_and_gives_and_has_an_example(name: str) -> None:
    signature, sections = inspect.signature(getattr(tribo, name)), sections_of(name)
    heads = re.findall(r"^\w.*", sections.get("Parameters", ""), re.MULTILINE)
    explained = {argument.lstrip("*") for head in heads for argument in head.split(" : ")[0].split(", ")}
    assert set(signature.parameters) == explained
    gives = not isinstance(getattr(tribo, name), type) and signature.return_annotation != "None"
    assert ("Returns" in sections) == gives
    assert ">>>" in sections.get("Examples", "")


class MadeOnce:
    """tribo, whose first stages are not run again with the same arguments: most examples begin with one campaign.

    That campaign is read once in a run of the tests.
    """

    def __init__(self, example: Ingested) -> None:
        self.made: dict[object, tuple[object, object]] = {}
        self.example = example

    def read(self, campaign: Campaign, **how: Any) -> Ingested:
        """What ``tribo.stages.ingest`` gives."""
        same = self.is_example(campaign) and how.get("rule", "first_peak") == "first_peak"
        return replace(self.example, campaign=campaign) if same else real_ingest(campaign, **how)

    def is_example(self, campaign: Campaign) -> bool:
        whole = self.example.campaign
        return campaign.root == whole.root and len(campaign.tests) == len(whole.tests)

    def __getattr__(self, name: str) -> Any:
        real = getattr(tribo, name)
        if name not in ("load_campaign", "ingest", "fit", "study"):
            return real

        def once(*args: Any, **options: Any) -> Any:
            if name == "ingest" and not options and self.is_example(args[0]):
                return self.example
            key = (name, *(str(a) if isinstance(a, str | Path) else id(a) for a in args), repr(options))
            if key not in self.made:
                self.made[key] = real(*args, **options), args  # the arguments are kept, and with them their identity
            return self.made[key][0]

        return once


WHOLE_RUNS = ("write_report", "compare", "verify", "StudyOptions", "diagnose", "Study", "Ingested", "assess")


@pytest.fixture(scope="module")
def made_once(example: Ingested) -> MadeOnce:
    return MadeOnce(example)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow) if n in WHOLE_RUNS else n for n in EXPLAINED]
)
def test_the_example_of_a_public_name_gives_what_it_says(
    name: str, made_once: MadeOnce, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(DOCS.parent)
    monkeypatch.setattr("tribo.stages.ingest", made_once.read)
    examples = doctest.DocTestFinder(recurse=False).find(getattr(tribo, name), name, globs={"tribo": made_once})
    results = [doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example) for example in examples]
    assert sum(result.attempted for result in results)
    assert not sum(result.failed for result in results)


@pytest.mark.slow
def test_the_python_of_the_readme_and_of_its_reference_runs_as_written(
    small_campaign: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    readme = (DOCS.parent / "README.md").read_text(encoding="utf-8").split("\nIn Python:\n")[1].split("\n## ")[0]
    reference = (DOCS / "reference" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", reference, re.DOTALL)
    shutil.copytree(small_campaign, tmp_path / "my-campaign")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(textwrap.dedent(readme), names)
    assert Path("out/report.html").is_file()
    shutil.rmtree("out")
    for block in blocks:
        exec(block, names)
    assert Path("out/report.html").is_file()
    assert Path("misfit.png").is_file()


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda page: str(page.relative_to(DOCS)))
def test_every_file_that_a_page_links_to_exists(page: Path) -> None:
    links = LINK.findall(page.read_text(encoding="utf-8"))
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_every_page_is_in_the_table_of_contents() -> None:
    listed = re.findall(r"^[a-z][\w/-]+$", (DOCS / "index.md").read_text(encoding="utf-8"), re.MULTILINE)
    pages = {str(page.relative_to(DOCS).with_suffix("")) for page in DOCS.rglob("*.md")} - {"index"}
    assert sorted(pages) == sorted(listed)


def test_every_mechanism_has_its_section_under_the_name_that_the_report_uses() -> None:
    page = (DOCS / "reference" / "mechanisms.md").read_text(encoding="utf-8")
    sections = dict(part.split("\n", 1) for part in re.split(r"^### ", page, flags=re.MULTILINE)[1:])
    assert sections.keys() == {sentence_case(m.in_words) for m in MECHANISMS.values()}
    for m in MECHANISMS.values():
        said = sections[sentence_case(m.in_words)]
        assert f"`{m.name}" in said
        for question in ("What it is:", "How it shows:", "What confuses it:", "Which test parts it:"):
            assert said.count(question) == 1, (m.name, question)


def test_a_search_for_the_words_of_an_identifier_finds_its_section() -> None:
    page = (DOCS / "reference" / "mechanisms.md").read_text(encoding="utf-8")
    assert "cavity shear deformation" in page
