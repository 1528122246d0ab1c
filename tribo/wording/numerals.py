"""Numbers as people write them."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence


def significant(value: float, digits: int = 3) -> str:
    """``value`` to so many significant digits, never in powers of ten; a dash where there is none."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return true_minus(f"{value:.{decimals}f}")


def with_uncertainty(value: float, u: float) -> str:
    """ "4.76 ± 0.73": the uncertainty to two significant digits, the value to the same place."""
    if not (math.isfinite(value) and math.isfinite(u)) or u <= 0:
        return significant(value)
    decimals = max(0, 1 - math.floor(math.log10(u)))
    if value:
        decimals = min(decimals, max(0, 4 - math.floor(math.log10(abs(value)))))
    shown_u = f"{u:.{decimals}f}" if u >= 0.5 * 10.0**-decimals else f"<{10.0**-decimals:.{decimals}f}"
    return true_minus(f"{value:.{decimals}f} ± {shown_u}")


def span(values: list[float], digits: int = 2) -> str:
    """ "0.55 to 0.58", or one number where all are the same at this precision."""
    finite = [v for v in values if math.isfinite(v)]
    if not finite:
        return "–"
    low, high = f"{min(finite):.{digits}f}", f"{max(finite):.{digits}f}"
    return true_minus(low if low == high else f"{low} to {high}")


def ratio_text(value: float) -> str:
    """Two decimals, three where two would hide on which side of 1 a ratio lies."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.3f}" if 0 < abs(value - 1) < 0.005 else f"{value:.2f}"


def unbroken(sentence: str) -> str:
    """The sentence with unbreakable spaces around = and ± and between a number and its unit."""
    sentence = re.sub(r" ([=±]) ", "\u00a0\\1\u00a0", sentence)
    return re.sub(r"(?<=\d) (?=(?:N|kPa|mm|s)\b|%)", "\u00a0", sentence)


def percent(fraction: float) -> str:
    """A fraction in whole percent, one decimal below 3 %."""
    value = 100 * fraction
    return true_minus(f"{value:.1f} %" if abs(value) < 2.95 else f"{value:.0f} %")


def joined(words: Sequence[str]) -> str:
    """ "A, B and C"."""
    return ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 1 else "".join(words)


def loads_in_words(levels_N: Sequence[float]) -> str:
    """ "6 loads from 0.0638 to 1.37 N", "1 load of 0.301 N", of loads in increasing order."""
    if len(levels_N) == 1:
        return f"1 load of {significant(levels_N[0])} N"
    return f"{counted(len(levels_N), 'load')} from {significant(levels_N[0])} to {significant(levels_N[-1])} N"


def counted(number: int, noun: str) -> str:
    """ "1 test", "3 tests"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def signed(value: float) -> str:
    """ "−57", "+8": a percentage in whole numbers with its sign; a dash where there is none."""
    return true_minus(f"{value:+.0f}") if math.isfinite(value) else "–"


def interval(low: float, high: float) -> str:
    """ "−60 to −54 %": the ends of an interval of a percentage."""
    return f"{signed(low)} to {signed(high)} %"


def general(value: float) -> str:
    """ "−6.13", "25": up to four digits, with a true minus sign."""
    return true_minus(f"{value:.4g}")


def true_minus(text: str) -> str:
    """Numbers in a text with the sign of typography in place of the hyphen."""
    return text.replace("-", "−")


def sentence_case(text: str) -> str:
    """With a capital first letter."""
    return text[:1].upper() + text[1:]


def p_text(p: float) -> str:
    """A p value to three decimals."""
    return "below 0.001" if p < 1e-3 else f"{p:.3f}"
