from .cuts import split_pulls as split_pulls
from .evaluation import (
    PullOptions as PullOptions,
    evaluate as evaluate,
    pieces_of as pieces_of,
    read_pulls as read_pulls,
)
from .events import slips_of as slips_of
from .features import features_of as features_of
from .phases import phases_of as phases_of
from .rules import RULES as RULES, Rule as Rule
from .sliding import oscillation_of as oscillation_of
from .zero import carry_load as carry_load, load_of as load_of
