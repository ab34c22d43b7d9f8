"""The parts of an HTML page: text without tags, headings, tables, addresses."""

import re
from html.parser import HTMLParser


class Page(HTMLParser):
    """The parts of an HTML page.

    Args:
        text: content of the file.
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.ids: set[str] = set()
        self.tags: list[str] = []
        self.headings: dict[str, list[str]] = {}  #: by tag, in their order.
        self.rows: dict[str, list[list[str]]] = {}  #: cells of tables, by the heading above.
        self._words: list[str] = []
        self._open: list[str] = []
        self._heading = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self._open.append(tag)
        for name, value in attrs:
            if name in {"src", "href", "srcset", "data", "action"}:
                self.addresses.append(value or "")
            if name == "id":
                self.ids.add(value or "")
        if tag in {"h1", "h2", "h3", "h4"}:
            self.headings.setdefault(tag, []).append("")
            self._heading = ""
        if tag == "tr":
            self.rows.setdefault(self._heading, []).append([])
        if tag == "td":
            self.rows[self._heading][-1].append("")
        if tag in {"br", "img", "meta", "link"}:
            self._open.pop()

    def handle_endtag(self, tag: str) -> None:
        while self._open and self._open.pop() != tag:
            pass

    def handle_data(self, data: str) -> None:
        inside = set(self._open)
        if inside & {"script", "style"}:
            return
        self._words.append(data)
        for tag in inside & set(self.headings):
            self.headings[tag][-1] += data
            self._heading += data
        if "td" in inside:
            self.rows[self._heading][-1][-1] += data

    @property
    def text(self) -> str:
        """Text of the page in one line."""
        return re.sub(r"\s+", " ", " ".join(self._words))
