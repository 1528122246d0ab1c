"""What all readers share: sources, layout, columns, numbers, and the doubts about them."""
