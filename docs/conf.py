"""Sphinx: the pages of this folder, the gallery of the experiments and the reference out of the docstrings.

Nothing is fetched: the site builds without a network.
"""

import os
import pkgutil
import re
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import Directive

# Compiled functions would have neither signature nor docstring.
os.environ["NUMBA_DISABLE_JIT"] = "1"

import clearance_mj
from clearance_mj import cli

HERE = Path(__file__).parent

project = "clearance_mj"
author = copyright = "The clearance_mj developers"
version = release = clearance_mj.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "numpydoc"]
templates_path = ["_templates"]
exclude_patterns = ["_build"]
default_role = "py:obj"
myst_heading_anchors = 3

autodoc_mock_imports = ["jax", "mujoco.mjx", "mujoco_warp", "warp"]  # whose extras exclude each other
autosummary_generate = True
INNER = [f"clearance_mj.cli.{module.name}" for module in pkgutil.iter_modules(cli.__path__)]
autosummary_context = {"inner": INNER}
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings say types, shapes and units
numpydoc_show_class_members = False

html_theme = "furo"
html_title = f"clearance_mj {version}"
html_static_path = ["_static"]
html_css_files = ["gallery.css", "wide.css"]
html_show_sourcelink = False


class Gallery(Directive):
    """Thumbnails of the pages of a folder: each page's title and first figure."""

    required_arguments = 1

    def run(self):
        """Return one linked figure for each page."""
        folder = HERE / self.arguments[0]
        self.state.document.settings.record_dependencies.add(str(folder))
        return [nodes.container("", *map(_thumbnail, sorted(folder.glob("*.md"))), classes=["gallery"])]


def _thumbnail(page):
    title = page.read_text(encoding="utf-8").partition("\n")[0].lstrip("# ")
    place = page.relative_to(HERE)
    link = nodes.reference("", "", refuri=f"{place.with_suffix('.html').as_posix()}")
    pictures = sorted(page.parent.glob(f"{page.stem}*.png"))
    if pictures:
        link += nodes.image(uri=pictures[0].relative_to(HERE).as_posix(), alt=title)
    link += nodes.inline("", title)
    return nodes.container("", nodes.paragraph("", "", link))


def _escape(app, what, name, thing, options, lines):
    """Docstrings are plain text, in which |x| is a magnitude and x_ no link; code between backticks stays as it is."""
    for i, line in enumerate(lines):
        parts = re.split(r"(`+[^`]+`+)", line)
        parts[::2] = (re.sub(r"\||(?<=\w)_(?!\w)", r"\\\g<0>", part) for part in parts[::2])
        lines[i] = "".join(parts)


_sidebars = {}  # by folder, whose pages have the same relative links


def _give_sidebar(app, pagename, templatename, context, doctree):
    """Let the sidebar list pages but no modules: a tree of 600 modules takes a second on each of their pages."""
    folder, _, name = pagename.rpartition("/")
    if "toctree" not in context:
        return
    if folder not in _sidebars:
        tree = context["toctree"](collapse=False, titles_only=True, maxdepth=1, includehidden=True) or ""
        tree = tree.replace('href="#"', f'href="{name}.html"').replace(" current", "").replace("current ", "")
        _sidebars[folder] = tree
    plain = f'<li class="toctree-l1"><a class="reference internal" href="{name}.html">'
    current = '<li class="toctree-l1 current"><a class="current reference internal" href="#">'
    context["toctree"] = lambda **_: _sidebars[folder].replace(plain, current)


def setup(app):
    """Register the directive; escape docstrings after numpydoc has read them; make sidebars before the theme does."""
    app.add_directive("gallery", Gallery)
    app.connect("html-page-context", _give_sidebar, priority=100)
    app.connect("autodoc-process-docstring", _escape, priority=900)
