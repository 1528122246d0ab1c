"""The card as text for a terminal."""

from __future__ import annotations

from tribo.report.card import Card


def card_text(card: Card) -> str:
    """The sentence, what it means, the tests, what else to know and the next test; the laws have their own table."""
    lines = [card.sentence, *(f"{name}: {meaning}" for name, meaning in card.meanings), card.counts, *card.to_know]
    if card.next_test is not None:
        lines.append(f"Next test: {card.next_test.line}")
    return "\n".join(lines)
