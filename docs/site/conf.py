"""Settings of the documentation site; ``make docs`` builds it into ``build/site``.

The source folder is the root of the repository, so that a link leads to the same file on the site and in it.
"""

import ast
import sys
import typing
from pathlib import Path
from typing import Any

import sphinx.util.inspect
import sphinx.util.typing

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

# Signatures show ``FloatArray``, not the type that it stands for. Every other module imports these names, so
# that they are replaced before the first one does.
from harness.basics import arrays  # noqa: E402

for _name in ("FloatArray", "IntArray", "BoolArray", "ByteArray", "AnyArray"):
    _alias = type(_name, (), {"__module__": arrays.__name__})
    setattr(arrays, _name, _alias)

# The limits that pydantic finds in ``Annotated`` types fill lines; the pages of the files list them.
_stringify = sphinx.util.typing.stringify_annotation


def _stringify_without_limits(annotation: Any, *arguments: Any, **options: Any) -> str:
    while typing.get_origin(annotation) is typing.Annotated:
        annotation = typing.get_args(annotation)[0]
    return _stringify(annotation, *arguments, **options)


sphinx.util.typing.stringify_annotation = _stringify_without_limits

# A default that is no expression, such as a function, would leave the whole signature without links.
_describe = sphinx.util.inspect.object_description


def _describe_default(value: Any, **options: Any) -> str:
    text = _describe(value, **options)
    try:
        ast.parse(text, mode="eval")
    except SyntaxError:
        return "..."
    return text


sphinx.util.inspect.object_description = _describe_default

project = "Touchstone"
author = "The Touchstone developers"
root_doc = "docs/site/index"
include_patterns = ["*.md", "docs/**.md", "docs/**.rst"]
exclude_patterns = [".*", "build", "runs", "*.egg-info"]
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx_design",
    "api_pages",
    "mathml",
    "source_pages",
]

# Any name or link that leads nowhere is a warning, and ``make docs`` fails on a warning.
nitpicky = True

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_fence_as_directive = {"math"}
smartquotes = False  # "--spacing" is an option
myst_disable_syntax = ["html_block", "html_inline"]
myst_heading_anchors = 6

napoleon_google_docstring = napoleon_numpy_docstring = False  # api_pages does it
autodoc_default_options = {"members": True, "undoc-members": True, "exclude-members": "model_config"}
autodoc_member_order = "bysource"
autodoc_use_type_comments = False
autodoc_typehints_format = "short"
python_maximum_signature_line_length = 80
python_use_unqualified_type_names = True
add_module_names = False
toc_object_entries = False

html_math_renderer = "mathml"
html_theme = "furo"
html_title = "Touchstone"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
html_additional_pages = {"index": "redirect.html"}
templates_path = ["templates"]
