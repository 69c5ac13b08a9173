"""A page of HTML read by the standard library's parser: tags, ids, links, text, tables."""

import re
from collections import Counter
from html import unescape
from html.parser import HTMLParser

VOID = {"area", "base", "br", "col", "embed", "hr", "img", "input", "link", "meta", "source", "wbr"}
LINKS = {"href", "xlink:href", "src", "srcset", "action", "formaction", "data", "poster", "cite"}


class Page(HTMLParser):
    """Tags, ids, links and text of a page; raises where tags do not balance."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: Counter[str] = Counter()
        self.ids: Counter[str] = Counter()
        self.links: list[str] = []
        self.handlers: list[str] = []
        self.open: list[str] = []
        self.title = self.body = ""
        self.feed(text)
        self.close()
        assert not self.open, f"left open: {self.open}"

    def handle_starttag(self, tag, attrs, void=False):
        self.tags[tag] += 1
        for name, value in attrs:
            if name == "id":
                self.ids[value] += 1
            if name in LINKS:
                self.links.append(value)
            if name.startswith("on"):
                self.handlers.append(name)
        if tag not in VOID and not void:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs, void=True)

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open} at {self.getpos()}"
        self.open.pop()

    def handle_data(self, data):
        if self.open == ["html", "head", "title"]:
            self.title += data
        elif "body" in self.open and not {"style", "script"} & set(self.open):
            self.body += data


def without_scripts(source: str) -> str:
    """A page's text but for its scripts and their data."""
    return re.sub(r"<script\b.*?</script>", "", source, flags=re.DOTALL)


def tables(source: str) -> list[list[list[str]]]:
    """Every table as rows of cells of plain text."""
    return [
        [
            [_plain(cell) for cell in re.findall(r"<t[hd]\b.*?</t[hd]>", row, re.DOTALL)]
            for row in re.findall(r"<tr\b.*?</tr>", table, re.DOTALL)
        ]
        for table in re.findall(r"<table.*?</table>", source, re.DOTALL)
    ]


def _plain(html: str) -> str:
    return " ".join(unescape(re.sub(r"<[^>]*>", "", html)).split())
