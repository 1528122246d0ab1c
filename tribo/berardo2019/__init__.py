"""The published tables of Berardo et al. (2019), and the diagnosis of their Table 2."""
