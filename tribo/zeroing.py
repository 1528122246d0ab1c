"""What a user may say of the zero of a channel, read from campaign.toml, tests.csv or the command line."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

from tribo.display import displayed

ZeroKind = Literal["default", "before contact", "at rest", "none", "value", "interval"]
ALLOWED = '"before contact", "at rest", "none", a number in newton, or [from, to] in seconds'
_WORDS: dict[str, ZeroKind] = {"before contact": "before contact", "at rest": "at rest", "none": "none"}
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_VALUE = re.compile(rf"({_NUMBER})(?:\s*N)?")
_INTERVAL = re.compile(rf"\[?\s*({_NUMBER})\s*(?:[,;]|to)\s*({_NUMBER})\s*\]?(?:\s*s)?")


@displayed()
@dataclass(frozen=True)
class ZeroChoice:
    """Where the zero of a force or load comes from.

    "default" leaves it to the record: the level before contact where one was recorded. ``value_N`` is the zero itself
    (kind "value"), ``interval_s`` the time over which it is read, on the clock of the record (kind "interval").
    """

    kind: ZeroKind = "default"
    value_N: float = math.nan
    interval_s: tuple[float, float] = (math.nan, math.nan)

    def __str__(self) -> str:
        if self.kind == "value":
            return f"{self.value_N:g} N"
        if self.kind == "interval":
            return f"mean from {self.interval_s[0]:g} to {self.interval_s[1]:g} s"
        return self.kind


DEFAULT = ZeroChoice()


def zero_choice(given: str | float | list[float] | None) -> ZeroChoice:
    """The choice that a text, a number of newtons or a pair of seconds makes; the default where nothing is given.

    Raises
    ------
    ValueError
        None of these; the message lists what is allowed.
    """
    if given is None or given == "":
        return DEFAULT
    text = " ".join(str(given).strip().strip("\"'").lower().replace("_", " ").split())
    if text in _WORDS:
        return ZeroChoice(_WORDS[text])
    if found := _VALUE.fullmatch(text.removesuffix("n").strip()):
        return ZeroChoice("value", value_N=float(found[1]))
    found = _INTERVAL.fullmatch(text)
    if found and float(found[1]) < float(found[2]):
        return ZeroChoice("interval", interval_s=(float(found[1]), float(found[2])))
    raise ValueError(f"a zero must be {ALLOWED}")
