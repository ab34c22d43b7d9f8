"""Formulas as MathML, which browsers draw without a script; a formula with an error is a warning."""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.writers.html5 import HTML5Translator

_LOGGER = logging.getLogger(__name__)


def _convert(code: str, node: nodes.Element, as_block: bool) -> str:
    # The converter knows neither an exponent without a base nor a style inside a group; GitHub renders both.
    code = re.sub(r"^\s*(?=[\^_])", "{}", code).replace(r"\textstyle", "")
    try:
        converted = str(tex2mathml(code, as_block=as_block))
    except (MathError, IndexError) as error:
        _LOGGER.warning("formula %r: %s", code, error, location=node, type="math")
        return ""
    return converted.replace("<mo>&ApplyFunction;</mo>", '<mspace width="0.17em"></mspace>')


def _visit_inline(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(_convert(node.astext(), node, as_block=False))
    raise nodes.SkipNode


def _visit_block(self: HTML5Translator, node: nodes.math_block) -> None:
    self.body.append(f'<div class="formula">{_convert(node.astext(), node, as_block=True)}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", (_visit_inline, None), (_visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
