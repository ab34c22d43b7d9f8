"""Directives that list the names of a package, and the Google style of their docstrings."""

import dataclasses
import importlib
import pkgutil
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.ext.napoleon.docstring import GoogleDocstring
from sphinx.util.docutils import SphinxDirective


class _Docstring(GoogleDocstring):
    """A docstring whose ``Returns`` is a description; its type is the annotation."""

    def _consume_returns_section(self, **_: object) -> list[tuple[str, str, list[str]]]:
        return [("", "", self._dedent(self._consume_to_next_section()))]


class PackageModules(SphinxDirective):
    """A section for each module of a package, in alphabetical order, but for packages inside it."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Parse one ``automodule`` for each module."""
        name = self.arguments[0]
        package = importlib.import_module(name)
        lines = [(package.__doc__ or "").strip(), ""]
        for module in pkgutil.iter_modules(package.__path__):
            if not module.ispkg:
                full = f"{name}.{module.name}"
                title = f"``{module.name}``"
                lines += [title, "-" * len(title), "", f".. automodule:: {full}", ""]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


class PublicApi(SphinxDirective):
    """The functions of ``harness.api``, each with the class of its result, then the remaining classes."""

    def run(self) -> list[nodes.Node]:
        """Parse one ``autofunction`` or ``autoclass`` for each public name."""
        api = importlib.import_module("harness.api")
        found = {name: getattr(api, name) for name in api.__all__}
        lines = []
        for kind, heading in (("function", "Functions"), ("class", "Results and options")):
            lines += [heading, "-" * len(heading), ""]
            for name, value in found.items():
                if isinstance(value, type) == (kind == "class"):
                    lines += [name, "~" * len(name), "", f".. auto{kind}:: harness.api.{name}", ""]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def format_docstring(app: Sphinx, what: str, name: str, value: Any, options: Any, lines: list[str]) -> None:
    """Turn the sections of a docstring into fields.

    ``sphinx.ext.napoleon`` would read the words before a colon in the docstring of an attribute as its type,
    and skip the sections of a property.
    """
    kind = "function" if what in ("attribute", "data", "property") else what
    lines[:] = _Docstring(lines, app.config, app, kind, name, value, options).lines()


def hide_fields(_app: Sphinx, what: str, _name: str, value: Any, *_: object) -> tuple[str, str] | None:
    """Leave out the signature of a class whose fields are documented below it."""
    has_fields = dataclasses.is_dataclass(value) or hasattr(value, "model_fields")
    return ("", "") if what in ("class", "exception") and has_fields else None


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives."""
    app.setup_extension("sphinx.ext.napoleon")
    app.connect("autodoc-process-docstring", format_docstring)
    app.connect("autodoc-process-signature", hide_fields)
    app.add_directive("package-modules", PackageModules)
    app.add_directive("public-api", PublicApi)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
