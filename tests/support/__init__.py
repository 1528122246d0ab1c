"""What several folders of tests and the benchmarks share."""
