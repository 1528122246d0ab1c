from .evaluation import (
    load_of as load_of,
    pieces_of as pieces_of,
    read_pull as read_pull,
    read_pulls as read_pulls,
    read_record as read_record,
    read_sliding as read_sliding,
    sampling_clip_N as sampling_clip_N,
    sampling_rate_Hz as sampling_rate_Hz,
)
from .oscillation import (
    StickSlip as StickSlip,
    oscillation_of as oscillation_of,
    stick_slip_cycles as stick_slip_cycles,
)
from .phases import Strokes as Strokes, orient_strokes as orient_strokes, split_pulls as split_pulls
from .rules import RULES as RULES, Rule as Rule
