"""The statistical model of a campaign: observations, fit, chance, intervals and gain."""
