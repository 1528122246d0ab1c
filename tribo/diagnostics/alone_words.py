"""The sentences of a diagnosis without the spring-block model."""

from __future__ import annotations

from collections.abc import Sequence

from tribo.diagnostics.column_search import ColumnEffect, SearchedColumns
from tribo.diagnostics.sentences import p_text, sentence_case
from tribo.diagnostics.terms import in_words, name_in_words
from tribo.diagnostics.verdict import Cause, Excluded, Layer, NextTest
from tribo.diagnostics.within_records import RunningIn, StrokeOffset
from tribo.mechanisms.record import ALONG_RECORDS, STROKES_APART
from tribo.mechanisms.table import MECHANISMS

SHOWN_BY = {shown: m.name for m in MECHANISMS.values() for shown in m.without_model}
ANY_COLUMN = next(m.name for m in MECHANISMS.values() if m.any_column)
MECHANISMS_OF_COLUMNS = {k: name for k, name in SHOWN_BY.items() if k not in (ALONG_RECORDS, STROKES_APART)}
UNITS = {"speed_mm_s": " mm/s", "hold_s": " s", "temperature_C": " °C", "humidity_pct": " %"}
SERIES = ("run_order", "specimen_run", "started_at", "date")  # columns that no one can vary
_MOST_SAID = 4


def name_of_column(column: str) -> str:
    """The name in a verdict of what follows a column: a mechanism of the library, or the column itself."""
    return MECHANISMS_OF_COLUMNS.get(column, f"{ANY_COLUMN}:{column}")


def of_column(f: ColumnEffect) -> str:
    """How friction follows a column, with the size of the change."""
    unit = UNITS.get(f.name, "")
    first, last = f.where
    between = f"from {first} to {last}{unit}" if f.kind == "trend" else f"between {first} and {last}{unit}"
    way = "rises" if f.change_percent > 0 else "falls"
    low, high = sorted((abs(f.low_percent), abs(f.high_percent)))
    said = (
        f"{sentence_case(f.regime)} friction {way} by {abs(f.change_percent):.1f} % with {in_words(f.name)}, {between} "
        f"(90 % interval {low:.1f} to {high:.1f} %, adjusted p {p_text(f.p)})."
    )
    if f.alike:
        said += f" This design cannot tell {in_words(f.name)} from {' and '.join(map(in_words, f.alike))}."
    return said


def of_records(records: Sequence[RunningIn]) -> str:
    """Running-in along records."""
    sizes = [f"{r.first_percent:+.0f} %".replace("-", "−") for r in records]
    shown = ", ".join(f"{r.test_id} ({r.sample}) {size}" for r, size in zip(records[:8], sizes, strict=False))
    more = f" and {len(records) - 8} more" if len(records) > 8 else ""
    share = 100.0 * records[0].distance_m / records[0].whole_m
    return (
        f"Running-in: over the first {share:.0f} % of the distance, sliding friction differs from that of the second "
        f"half in {len(records)} record{'s' if len(records) > 1 else ''}: {shown}{more} (adjusted p at most "
        f"{max(max(r.p for r in records), 0.001):.2g})."
    )


def of_strokes(a: StrokeOffset) -> str:
    """The offset between strokes in both directions."""
    return (
        f"The force recorded in {a.strokes[0]} forward and {a.strokes[1]} backward strokes is offset by "
        f"{a.offset.value:.3g} N (90 % interval {a.offset.low:.3g} to {a.offset.high:.3g} N), {abs(a.percent):.0f} % "
        "of the sliding force: the directions differ by twice that. The offset was subtracted as the zero of each pair."
    )


def only_with_load(column: str) -> str:
    return (
        f"This design cannot tell the effect of {in_words(column)} from that of the normal load: within each sample, "
        f"{in_words(column)} varies only together with the load."
    )


def vary_together(one: str, other: str, samples: Sequence[str]) -> str:
    where = _listed(samples)
    return f"This design cannot tell the effect of {one} from that of {other}: they vary together for {where}."


def not_varied_column(column: str) -> str:
    return f"cannot be tested with this design: {in_words(column)} does not vary or is not recorded"


def load_test(columns: Sequence[str]) -> NextTest:
    """For columns that vary only together with the load."""
    names = tuple(map(in_words, columns))
    text = f"To tell {_listed(names)} from the load, repeat four loads of the range, three times each, in random order."
    design = {"loads": 4, "repeats": 3, "order": "random", "pulls": 12, "hours": 1.4}
    return NextTest(text, (*columns, "normal_load_N"), design, float("nan"))


def parting_test(f: ColumnEffect) -> NextTest:
    """For columns with the same effect in this design."""
    names = (f.name, *f.alike)
    varied = next((name for name in names if name not in SERIES), "")
    others = _listed([in_words(name) for name in names if name != varied])
    how = f"Choose the values of {in_words(varied)} at random, independently of {others}"
    if not varied:
        how = f"Repeat pulls of the beginning of the series after all others, to separate {others}"
    text = f"{how}: 12 pulls."
    return NextTest(text, names, {"covariate": f.name, "pulls": 12, "hours": 1.4}, float("nan"))


def summary(
    layers: Sequence[Layer], causes: Sequence[Cause], inseparable: Sequence[Excluded], found: Sequence[SearchedColumns],
    too_few: str,
) -> str:
    """The verdict in a few sentences: the laws, what friction varies with, what cannot be told."""
    laws = [layer.text for layer in layers if layer.kind == "baseline"]
    said = laws[:_MOST_SAID]
    said += [f"The laws of {len(laws) - _MOST_SAID} more are listed below."] if len(laws) > _MOST_SAID else []
    if causes:
        names = list(dict.fromkeys(name_in_words(c.mechanism) for c in causes))
        said.append(f"Found beside the law of each sample: {'; '.join(names)}.")
        said += [c.text for c in causes]
    elif found:
        tested = sorted({in_words(name) for s in found for name in s.columns})
        columns = f"Tested: {_listed(tested)}." if tested else "No further column varies."
        said.append(f"Beside the law of each sample, nothing exceeds chance. {columns}")
    said += [too_few] if too_few else []
    said += [e.reason for e in inseparable]
    return " ".join(said)


def _listed(names: Sequence[str]) -> str:
    shown = list(names[:6]) + ([f"{len(names) - 6} more"] if len(names) > 6 else [])
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} and {shown[-1]}"
