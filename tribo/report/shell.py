"""What all pages share: their templates, and the one style and the one script that each page allows by their hashes."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from functools import lru_cache
from hashlib import sha256

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tribo.wording.numerals import ratio_text, significant, unbroken

OWN = "tribo.report"
STYLE = "style.css"
WORKING = ("helpers.js", "reading.js")  # scripts of every page; all scripts are joined in one function, in this order


@lru_cache(maxsize=2)
def environment(*others: str) -> Environment:
    """The templates of this package and those of ``others``, with the filters that they use."""
    found = Environment(
        loader=ChoiceLoader([PackageLoader(name) for name in (*others, OWN)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    found.filters |= {"sig": significant, "ratio": ratio_text, "unbroken": unbroken}
    return found


def style_and_script(templates: Environment, styles: Sequence[str], scripts: Sequence[str]) -> dict[str, str]:
    """What ``base.html`` needs of both: the texts of these files, joined, and their hashes for its policy.

    Parameters
    ----------
    templates : Environment
        The templates among which the files are (:func:`environment`).
    styles, scripts : sequence of str
        Names of the files, in the order in which they are joined.
    """
    style = "".join(_static(templates, name) for name in styles)
    script = '"use strict";\n(() => {\n' + "".join(_static(templates, name) for name in scripts) + "})();\n"
    return {
        "style": Markup(style), "style_hash": _csp_hash(style), "script": Markup(script),
        "script_hash": _csp_hash(script),
    }  # fmt: skip


def script_json(record: object) -> Markup:
    """JSON that cannot end its script element, whatever names a campaign uses."""
    text = json.dumps(record, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029"))


def _static(templates: Environment, name: str) -> str:
    assert templates.loader is not None
    return templates.loader.get_source(templates, name)[0]


def _csp_hash(text: str) -> str:
    """The source expression by which the page allows exactly this style or script and no other."""
    return "sha256-" + base64.b64encode(sha256(text.encode("utf-8")).digest()).decode("ascii")
