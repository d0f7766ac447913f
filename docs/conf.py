"""How Sphinx builds these pages: ``python -m sphinx -W -b html docs docs/_build/html``."""

from __future__ import annotations

import sys
from pathlib import Path

import hydrodamp

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

project = "hydrodamp"
author = "The hydrodamp developers"
copyright = "The hydrodamp developers, Apache-2.0"
version = release = hydrodamp.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "numpydoc",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",  # MathJax in the pages, which are read at sea too
    "sphinx_copybutton",
    "catalogue",
    "commands",
    "public_names",
]
exclude_patterns = ["_build", "_extensions", "jupyter_execute"]

html_theme = "furo"
# An unknown macro is an error, which a test looks for, rather than red text.
mathjax3_config = {"tex": {"packages": {"[-]": ["noerrors", "noundefined"]}}}
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_title = f"hydrodamp {release}"
html_show_sourcelink = False

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

# Every build runs the notebooks; a notebook that fails or hangs fails the build.
nb_execution_mode = "force"
nb_execution_cache_path = str(Path(__file__).parent / "_build" / ".jupyter_cache")
nb_execution_in_temp = True
nb_execution_timeout = 600  # seconds a cell; a busy machine with two cores takes up to 90
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_merge_streams = True

# Shapes and units stand on the type lines of the docstrings, so signatures need no types.
autodoc_typehints = "none"
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
toc_object_entries_show_parents = "hide"
add_module_names = False

copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
copybutton_exclude = ".linenos, .gp, .go"
