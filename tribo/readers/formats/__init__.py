"""One module for each family of export formats."""
