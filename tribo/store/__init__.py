"""Results kept between starts, files written whole, and locks."""
