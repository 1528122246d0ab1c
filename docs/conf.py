"""How the documentation is built: `make docs`. No network is needed, and a warning is an error."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "tribo"
author = "The tribo contributors"
copyright = "The tribo contributors, BSD-3-Clause"

extensions = [
    "myst_nb", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "mathml", "public_names", "tribo_tables",
]  # fmt: skip
exclude_patterns = ["data", "extensions"]

html_theme = "furo"
html_title = "tribo"
html_static_path = []
html_copy_source = False
html_math_renderer = "mathml"

myst_enable_extensions = ["deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3
nb_execution_mode = "cache"
nb_execution_cache_path = str(Path(__file__).parents[1] / "out" / "docs-executed")
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True

autosummary_generate = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"members": True, "undoc-members": True}
autodoc_preserve_defaults = True
numpydoc_show_class_members = False
numpydoc_class_members_toctree = False

# every reference to a name of tribo must resolve (see public_names); names of other projects are words here
nitpicky = True
nitpick_ignore_regex = [("py:.*", r"(?!tribo\.).*")]

# `make links`: internal links are checked by the build itself, these are listed and not fetched
linkcheck_ignore = [r"https?://.*"]
