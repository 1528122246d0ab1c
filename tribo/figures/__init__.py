"""Records in, matplotlib figures out: no files, no pyplot. The table of them is in ``catalogue``."""
