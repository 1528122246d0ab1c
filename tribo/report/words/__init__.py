"""The text of a report: findings, sentences, number formats, terminal output."""
