"""Diagnoses that several files look at, each made once in a run of the tests."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tribo.diagnostics import Diagnosis, examine
from tribo.records import Ingested

from .known import made
from .synthetic import hidden
from .test_scatter import off

Once = Callable[[str, Callable[[Path], object]], Path]
CAMPAIGNS: dict[str, Callable[[], Ingested]] = {
    "nothing": hidden,
    "temperature": lambda: hidden(("temperature", 4.0)),
    "patterns_off": lambda: hidden(seed=3, design=off(6.0)),  # six times as far from the model as its stated error
    "nothing_of_known_size": lambda: made(lambda s: np.zeros((s.observations.n, 2)), seed=102),
}


def examined(name: str, once: Once) -> Diagnosis:
    """The diagnosis of one of these campaigns; ``once`` is the fixture of that name."""

    def make(folder: Path) -> None:
        folder.mkdir()
        found = examine(CAMPAIGNS[name](), replicates=(40, 40))
        (folder / "diagnosis.pickle").write_bytes(pickle.dumps(found))

    found: Diagnosis = pickle.loads((once(f"examined_{name}", make) / "diagnosis.pickle").read_bytes())
    return found
