"""What a report says, in words: findings, sentences, numbers, the terminal."""
