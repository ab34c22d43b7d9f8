"""From a template beside this module to a page that refers to nothing outside itself."""

from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from harness.basics.whole_file import write_text_whole


def write_page(path: Path, template: str, **content: Any) -> Path:
    """Write a page, with the style of all reports as ``style``; its path.

    Args:
        path: of the page; a file of that name is replaced.
        template: name of the file.
        content: by the names that the template uses; one that is missing is an error.
    """
    environment = Environment(
        loader=PackageLoader("harness.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals["kind_of"] = lambda block: type(block).__name__
    style = environment.get_template("report.css").render()
    write_text_whole(path, environment.get_template(template).render(style=style, **content))
    return path
