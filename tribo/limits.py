"""Limits on everything that is read, in one place; each is checked before the work that it bounds.

The reasons are in docs/reference/limits.md. Numbers are limits of a computer unless a source is named.
"""

from __future__ import annotations

# Files
LARGEST_EXPORT_BYTES = 2 << 30
LARGEST_TABLE_BYTES = 100_000_000  # tests.csv, overrides.csv
LARGEST_DESCRIPTION_BYTES = 1_000_000  # campaign.toml, a design file
LONGEST_NAME = 150  # characters of a campaign folder: files named after it stay below the 255 bytes of file systems

# Tables
LONGEST_CELL = 10_000  # characters
MOST_TABLE_ROWS = 200_000  # rows of tests.csv or overrides.csv
MOST_COLUMNS = 1_000
MOST_EXPORT_ROWS = 40_000_000  # reading takes 8 bytes a number, and a pull about 110 bytes a row: 4.4 GB

# Texts with levels
DEEPEST_NESTING = 50  # arrays and tables within each other in TOML and JSON

# Designs of simulations
MOST_RUNS = 50_000
MOST_BLOCKS = 4_000_000  # 2000 x 2000; a run of them takes about 2 GB
MOST_STEPS = 100_000_000  # of a run

# Zip archives
MOST_ENTRIES = 50_000
MOST_UNPACKED_BYTES = 2_000_000_000
MOST_UNPACKED_EXPORT_BYTES = 400_000_000  # of an export in a .zip or .gz, which is held in memory
MOST_EXPANSION = 200  # text of numbers shrinks about three- to tenfold
SMALL_ENTRY_BYTES = 10_000_000  # below this no expansion is a danger
MOST_WORKBOOK_BYTES = 200_000_000  # an Excel export, unpacked
LONGEST_ENTRY_NAME_BYTES = 1_000
LONGEST_PATH_PART_BYTES = 255  # on all common file systems
DEEPEST_PATH = 32
LARGEST_LISTING_BYTES = 200 * MOST_ENTRIES  # of the list of entries: 46 bytes, a name and time stamps each

# Numbers in SI units. Squares of these, summed over the longest table, stay finite and above zero in double precision;
# no friction test comes near them.
LARGEST_NUMBER = 1e15
SMALLEST_NUMBER = 1e-18  # a force or time base whose largest number is below this was not measured
LARGEST_LOAD_N = 1e12
SMALLEST_LOAD_N = 1e-15  # a tenth of the thermal noise of the finest force microscopes is above this
LARGEST_COUNT = 2**53  # larger whole numbers are not exact in double precision
ABSOLUTE_ZERO_C = -273.15
FIRST_YEAR, LAST_YEAR = 1900, 2199  # of a measurement
