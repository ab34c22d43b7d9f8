"""From a template beside this module to a page that refers to nothing outside itself."""

from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined


def rendered(template: str, **content: Any) -> str:
    """The page, with the style of all reports as ``style``.

    Args:
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
    style = environment.get_template("report.css").render()
    return environment.get_template(template).render(style=style, **content)
