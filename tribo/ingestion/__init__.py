"""From the exports of a campaign to its traces and pulls, with decisions made by hand applied."""
