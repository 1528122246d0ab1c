"""Results kept between starts, files written as a whole, and locks."""
