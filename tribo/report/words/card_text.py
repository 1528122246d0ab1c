"""The card as text for a terminal."""

from __future__ import annotations

from tribo.report.card import Card


def card_text(card: Card) -> str:
    """The sentence, what it means, the tests, mu and tau0 of every sample, what else to know and the next test."""
    lines = [card.sentence, *(f"{name}: {meaning}" for name, meaning in card.meanings), card.counts]
    lines += card.to_know
    if card.next_test is not None:
        lines.append(f"Next test: {next_text(card)}")
    return "\n".join(lines)


def next_text(card: Card) -> str:
    """The next test with its reason and its duration, in one line; empty where none is recommended."""
    step = card.next_test
    if step is None:
        return ""
    return f"{step.what.rstrip('.')}{hours_text(step.hours)}: {step.why}."


def hours_text(hours: float | None) -> str:
    """ " (about 2.1 h)"; empty where nobody can say."""
    if hours is None:
        return ""
    return f" (about {hours:.1f} h)" if hours >= 1 else f" (about {60 * hours:.0f} min)"
