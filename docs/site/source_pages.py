"""Pages that show files of the repository, and the references that lead to them.

A link of a page to a file or a folder that is no page leads to a view of it. So does a type of this project
that no page documents, and every documented function and class links to its source. A name that is defined
nowhere stays unresolved, and the build fails.
"""

import ast
import builtins
import html
import importlib
import posixpath
import sys
from functools import cache
from pathlib import Path
from typing import Any

from docutils import nodes
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import TextLexer, get_lexer_for_filename
from pygments.util import ClassNotFound
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.transforms import SphinxTransform
from sphinx.util import logging
from sphinx.util.nodes import find_pending_xref_condition

_LOGGER = logging.getLogger(__name__)

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("touchstone", "harness", "experiments", "calibration", "drivers", "mocks")
BINARY = {".png", ".jpg", ".ipynb", ".npz", ".onnx"}
"""Endings of files that a link downloads."""

FOLDERS = {
    "docs/tutorials": "docs/site/start",
    "docs/how-to": "docs/site/use",
    "docs/reference": "docs/site/reference",
    "docs/explanation": "docs/site/explanation",
    "docs/results": "docs/site/results",
    "docs/decisions": "docs/site/develop",
}
"""Page of the site that lists the pages of a folder."""

SOURCED = {"class", "exception", "function", "method", "property", "classmethod", "staticmethod"}
"""Kinds of documented names that have a link to their source."""

EXTERNAL = {"numpy": "https://numpy.org/doc/stable/reference/generated/{name}.html"}
"""Address of the documentation of a name, by package."""

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<link rel="stylesheet" href="{root}/_static/pygments.css">
<link rel="stylesheet" href="{root}/_static/source.css">
</head>
<body>
<header><a href="{root}/docs/site/index.html">Touchstone</a> / <code>{title}</code></header>
{body}
</body>
</html>
"""


@cache
def defined_lines(path: Path) -> dict[str, int]:
    """Return the line of every class, function and variable of a module; methods are ``Class.method``."""
    lines: dict[str, int] = {}

    def visit(body: list[ast.stmt], prefix: str) -> None:
        for node in body:
            targets: list[ast.expr] = []
            if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
                lines.setdefault(prefix + node.name, node.lineno)
            elif isinstance(node, ast.Assign):
                targets = node.targets
            elif isinstance(node, ast.AnnAssign):
                targets = [node.target]
            if isinstance(node, ast.ClassDef):
                visit(node.body, f"{prefix}{node.name}.")
            for target in targets:
                if isinstance(target, ast.Name):
                    lines.setdefault(prefix + target.id, node.lineno)

    visit(ast.parse(path.read_text(encoding="utf-8")).body, "")
    return lines


@cache
def module_files() -> dict[str, Path]:
    """Return the file of every module of the project."""
    files = {}
    for package in PACKAGES:
        for path in (ROOT / package).rglob("*.py"):
            parts = path.relative_to(ROOT).with_suffix("").parts
            files[".".join(parts).removesuffix(".__init__")] = path
    return files


@cache
def type_homes() -> dict[str, set[str]]:
    """Return the modules that define a class or a type alias, by its name without the module."""
    homes: dict[str, set[str]] = {}
    for module, path in module_files().items():
        for name in defined_lines(path):
            if name[0].isupper() and not name.isupper() and "." not in name:
                homes.setdefault(name, set()).add(module)
    return homes


def find_definition(name: str) -> tuple[Path, int] | None:
    """Return the file and the line that define a name of the project; None for any other name.

    Args:
        name: with its module, or the name of a class that one module defines.
    """
    homes = type_homes().get(name, set())
    if len(homes) == 1:
        path = module_files()[next(iter(homes))]
        return path, defined_lines(path)[name]
    module, rest = name, ""
    while "." in module and module not in module_files():
        module, _, last = module.rpartition(".")
        rest = f"{last}.{rest}" if rest else last
    found = module_files().get(module)
    if found is None:
        return None
    lines = defined_lines(found)
    return (found, lines.get(rest, 1)) if not rest or rest in lines else None


def external_address(name: str) -> str | None:
    """Return the address of the documentation of a name of another package.

    Returns:
        "" if the package has no address here, None if the name does not exist.
    """
    package = name.partition(".")[0]
    if hasattr(builtins, name):
        kind = "exceptions" if name.endswith(("Error", "Exception", "Interrupt")) else "functions"
        return f"https://docs.python.org/3/library/{kind}.html#{name}"
    if package in PACKAGES:
        return None
    module, rest = name, ""
    while module and module not in sys.modules:
        module, _, last = module.rpartition(".")
        rest = f"{last}.{rest}" if rest else last
    value: Any = sys.modules.get(module)
    for part in rest.split(".") if rest else []:
        value = getattr(value, part, None)
    if value is None:
        return None
    if package in sys.stdlib_module_names:
        return f"https://docs.python.org/3/library/{module}.html#{name}"
    return EXTERNAL.get(package, "").format(name=name)


def view_address(app: Sphinx, docname: str, path: Path, line: int | None = None) -> str:
    """Return the address, relative to a page, of the view of a file, and have this view written."""
    name = path.relative_to(ROOT).as_posix()
    shown_files(app.env).add(name)
    anchor = "" if line is None else f"#L-{line}"
    return app.builder.get_relative_uri(docname, f"source/{name}") + anchor


def shown_files(env: BuildEnvironment) -> set[str]:
    """Return the files that the site shows, kept between builds."""
    if not hasattr(env, "shown_files"):
        env.shown_files = set()
    files: set[str] = env.shown_files
    return files


class FileLinks(SphinxTransform):
    """Replace the links of a page to files and folders of the repository."""

    default_priority = 500

    def apply(self) -> None:
        """Replace downloads of text by its view, and links to folders by a list of their files."""
        for node in list(self.document.findall(addnodes.download_reference)):
            path = self._path(node)
            if path.is_file() and path.suffix not in BINARY:
                self._replace(node, view_address(self.app, self.env.docname, path))
        for node in list(self.document.findall(addnodes.pending_xref)):
            if node.get("reftype") != "myst" or node.get("refdomain") == "doc":
                continue
            path = self._path(node)
            if path.is_dir() and path.is_relative_to(ROOT):
                page = FOLDERS.get(path.relative_to(ROOT).as_posix())
                address = (
                    view_address(self.app, self.env.docname, path)
                    if page is None
                    else self.app.builder.get_relative_uri(self.env.docname, page)
                )
                self._replace(node, address)

    def _path(self, node: nodes.Element) -> Path:
        return (ROOT / self.env.docname).parent.joinpath(node["reftarget"].partition("#")[0]).resolve()

    def _replace(self, node: nodes.Element, address: str) -> None:
        reference = nodes.reference("", "", internal=True, refuri=address)
        reference += node.children
        node.replace_self(reference)


def add_source_links(app: Sphinx, document: nodes.document) -> None:
    """Link each documented class and function to its source; resolve built-in types before any other name."""
    for signature in document.findall(addnodes.desc_signature):
        if "~" in signature.astext():
            _LOGGER.warning("a signature without links: %s", signature.astext(), location=signature)
        if signature.get("module") and signature.parent.get("objtype") in SOURCED:
            name = signature["fullname"]
            outer = getattr(importlib.import_module(signature["module"]), name.partition(".")[0])
            found = find_definition(f"{outer.__module__}.{name}")
            if found is not None:
                link = nodes.reference(
                    "", "", internal=True, refuri=view_address(app, app.env.docname, *found)
                )
                link += nodes.inline("", "[source]", classes=["viewcode-link"])
                signature += link
    for node in list(document.findall(addnodes.pending_xref)):
        if node.get("refdomain") == "py" and hasattr(builtins, node["reftarget"]):
            resolved = find_pending_xref_condition(node, "resolved")
            children = node.children if resolved is None else resolved.children
            node.replace_self(nodes.reference("", "", *children, refuri=external_address(node["reftarget"])))


def resolve_name(
    app: Sphinx, env: BuildEnvironment, node: addnodes.pending_xref, content: nodes.TextElement
) -> nodes.Element | None:
    """Resolve a name in a signature or a docstring that no page documents."""
    if node.get("refdomain") != "py":
        return None
    target = node["reftarget"]
    docname = node.get("refdoc", env.docname)
    resolved = find_pending_xref_condition(node, "resolved")
    content = content if resolved is None else resolved[0]
    documented = env.domains.python_domain.objects
    for module in type_homes().get(target, ()):
        entry = documented.get(f"{module}.{target}") or documented.get(f"harness.api.{target}")
        if entry is not None:
            address = app.builder.get_relative_uri(docname, entry.docname) + f"#{entry.node_id}"
            return nodes.reference("", "", content, internal=True, refuri=address)
    found = find_definition(target)
    if found is not None:
        return nodes.reference("", "", content, internal=True, refuri=view_address(app, docname, *found))
    outside = external_address(target)
    if outside is None:
        return None
    return nodes.reference("", "", content, refuri=outside) if outside else content


def report_missing(_app: Sphinx, domain: Any, node: addnodes.pending_xref) -> bool:
    """Warn of an unknown name, with the object whose docstring or signature contains it."""
    if domain is None or domain.name != "py":
        return False
    place: nodes.Node | None = node
    while place is not None and not isinstance(place, addnodes.desc | addnodes.desc_signature):
        place = place.parent
    signature = place[0] if isinstance(place, addnodes.desc) else place
    where = signature["ids"][0] if signature is not None and signature["ids"] else node.get("refdoc")
    _LOGGER.warning(
        "%s: nothing is named %s", where, node["reftarget"], location=node.get("refdoc"), type="ref"
    )
    return True


def write_views(app: Sphinx, exception: Exception | None) -> None:
    """Write the views of all files that a page leads to."""
    if exception is not None or app.builder.format != "html":
        return
    names = set(shown_files(app.env))
    for name in shown_files(app.env):
        names.update(path.relative_to(ROOT).as_posix() for path in files_in(ROOT / name))
    for name in sorted(names):
        path = ROOT / name
        body = list_files(path) if path.is_dir() else show_file(path)
        target = app.outdir / "source" / f"{name}.html"
        target.parent.mkdir(parents=True, exist_ok=True)
        root = posixpath.relpath(".", posixpath.dirname(f"source/{name}"))
        target.write_text(PAGE.format(title=html.escape(name), root=root, body=body), encoding="utf-8")


def files_in(folder: Path) -> list[Path]:
    """Return the files of a folder; none of what is no folder."""
    return sorted(path for path in folder.iterdir() if path.is_file()) if folder.is_dir() else []


def list_files(folder: Path) -> str:
    """Return links to the views of the files of a folder."""
    names = [html.escape(path.name) for path in files_in(folder)]
    rows = (f'<li><a href="{folder.name}/{name}.html">{name}</a></li>' for name in names)
    return f"<ul>{''.join(rows)}</ul>"


def show_file(path: Path) -> str:
    """Return a file as HTML with numbered lines, which are anchors."""
    try:
        lexer = get_lexer_for_filename(path.name)
    except ClassNotFound:
        lexer = TextLexer()
    form = HtmlFormatter(linenos="inline", lineanchors="L", anchorlinenos=True, wrapcode=True)
    return str(highlight(path.read_text(encoding="utf-8"), lexer, form))


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect the links and the views."""
    app.add_transform(FileLinks)
    app.connect("doctree-read", add_source_links)
    app.connect("missing-reference", resolve_name)
    app.connect("warn-missing-reference", report_missing)
    app.connect("build-finished", write_views)
    return {"parallel_read_safe": False}
