"""From the exports of a campaign to its traces and pulls, with what a person decided about single pulls applied."""
