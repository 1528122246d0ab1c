from .extended_run import parse_given as parse_given, parse_with as parse_with, simulate_with as simulate_with
from .on_blocks import columns_from as columns_from, with_law as with_law
