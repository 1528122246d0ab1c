"""Numbers against broad physical bounds: what is outside is a doubt, with the slip that may explain it."""
