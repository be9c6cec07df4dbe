"""Settings of Sphinx."""

import re

project = "scruton"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "scruton"
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"


def _plain_bars(app, what, name, obj, options, lines):  # type: ignore[no-untyped-def]
    """Keep |x| a modulus: reStructuredText takes it for the name of a substitution."""
    lines[:] = [re.sub(r"(?<![\w\\])\|(\w[\w' -]*)\|", r"\\|\1\\|", line) for line in lines]


def setup(app):  # type: ignore[no-untyped-def]
    """Connect what is defined here."""
    app.connect("autodoc-process-docstring", _plain_bars)
