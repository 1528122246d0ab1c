from .cycles import StickSlip as StickSlip, stick_slip_cycles as stick_slip_cycles
from .oscillation import oscillation_of as oscillation_of
from .pull import read_pull as read_pull
from .rules import RULES as RULES, Rule as Rule
from .segments import Strokes as Strokes, orient_strokes as orient_strokes, split_pulls as split_pulls
from .strokes import (
    load_of as load_of,
    pieces_of as pieces_of,
    read_pulls as read_pulls,
    read_sliding as read_sliding,
    sampling_clip_N as sampling_clip_N,
    sampling_rate_Hz as sampling_rate_Hz,
)
from .whole_record import read_record as read_record
