"""Serve MathJax from the built site instead of a content delivery network.

The wheel `sphinx-mathjax-offline` carries MathJax 3; its own extension copies all of it. A page needs one
script and the web fonts, which are copied here.
"""

from importlib.metadata import files
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.util.fileutil import copy_asset

SCRIPT = "tex-chtml-full.js"
FONTS = "output/chtml/fonts/woff-v2"


def copy_mathjax(app: Sphinx, exception: Exception | None) -> None:
    if exception is None and app.builder.format == "html":
        script = next(f for f in files("sphinx-mathjax-offline") if f.match(f"static/mathjax/{SCRIPT}"))
        source = Path(script.locate()).parent
        target = Path(app.outdir) / "_static" / "mathjax"
        copy_asset(source / SCRIPT, target)
        copy_asset(source / FONTS, target / FONTS)


def setup(app: Sphinx) -> None:
    app.config.mathjax_path = f"mathjax/{SCRIPT}"
    app.connect("build-finished", copy_mathjax)
