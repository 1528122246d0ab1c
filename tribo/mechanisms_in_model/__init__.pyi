from .extended_run import parse_given as parse_given, parse_with as parse_with, simulate_with as simulate_with
from .on_blocks import (
    Recorder as Recorder,
    as_recorded as as_recorded,
    columns_from as columns_from,
    with_law as with_law,
)
