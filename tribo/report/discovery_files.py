"""What tribo discover writes: laws, the table of scores, and the record of a test of a law."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tribo.diagnose.discovery.law_file import law_text
from tribo.diagnose.discovery.law_words import discovery_text, law_layers, subject
from tribo.store.whole_files import write_text

if TYPE_CHECKING:
    from tribo.diagnose.discovery.held import Held
    from tribo.diagnose.discovery.search import Discovery


@dataclass(frozen=True)
class Written:
    """What was written, as a record and in words."""

    record: dict[str, Any]
    text: str


def write_discovery(d: Discovery, title: str, out: Path) -> Written:
    """law-1.toml and further laws, laws.csv (the best of all that were tried) and discovery.json."""
    import pandas as pd

    out.mkdir(parents=True, exist_ok=True)
    text = discovery_text(d)
    for k, found in enumerate(d.laws, start=1):
        write_text(out / f"law-{k}.toml", law_text(found.law, found.parameters, title))
    rows = [
        {
            "formula": s.law.formula(), "regime": s.law.regime, "where": s.law.where, "log_likelihood_gain": s.gain,
            "net_of_choosing": s.net, "acts_on": subject(s.law),
        }
        for s in d.scored
    ]  # fmt: skip
    write_text(out / "laws.csv", pd.DataFrame(rows).to_csv(index=False, float_format="%.4g"))
    layers = [asdict(layer) for layer in law_layers(d)]
    record: dict[str, Any] = {
        "schema": "tribo.discovery/1", "text": text, "laws_tried": d.searched, "layers": layers,
        "ties": [f.n_ties for f in d.laws],
    }  # fmt: skip
    write_text(out / "discovery.json", json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    return Written(record, text)


def write_held(held: Held, out: Path) -> Written:
    """discovery.json of the test of one law."""
    out.mkdir(parents=True, exist_ok=True)
    record: dict[str, Any] = {"schema": "tribo.discovery/1", **asdict(held)}
    write_text(out / "discovery.json", json.dumps(record, indent=2, ensure_ascii=False, allow_nan=False) + "\n")
    return Written(record, held.text)
