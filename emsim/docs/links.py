"""Links that lead nowhere: in the built site (pages, anchors, pictures, scripts) and in the Markdown of the tree.

Addresses on the network are not asked for; but a page of the site that would fetch something from there is reported.
"""

from __future__ import annotations

import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# attributes that make a browser fetch something as it shows the page
FETCHED = {
    ("script", "src"),
    ("img", "src"),
    ("iframe", "src"),
    ("source", "src"),
    ("audio", "src"),
    ("video", "src"),
}
SHEETS = ("stylesheet", "preload", "preconnect", "icon", "modulepreload")


class Page(HTMLParser):
    """Anchors of a page, and what it links to: (address, is fetched at once)."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = {"", "top"}
        self.links: list[tuple[str, bool]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        for key in ("id", "name"):
            if (anchor := given.get(key)) is not None:
                self.anchors.add(anchor)
        for key, value in attrs:
            if key not in ("href", "src") or value is None:
                continue
            sheet = tag == "link" and any(word in (given.get("rel") or "") for word in SHEETS)
            self.links.append((value, (tag, key) in FETCHED or sheet))

    handle_startendtag = handle_starttag


def site(folder: Path) -> list[str]:
    """What is wrong with the links of a built site, one line each."""
    pages = {path: Page(path.read_text(encoding="utf-8")) for path in sorted(folder.rglob("*.html"))}
    wrong = []
    for path, page in pages.items():
        for address, fetched in page.links:
            parts = urlsplit(address)
            if parts.scheme in ("data", "mailto", "javascript"):
                continue
            if parts.scheme or parts.netloc:
                if fetched:
                    wrong.append(f"{path.relative_to(folder)}: fetches {address}")
                continue
            # the page for wrong addresses is served from anywhere: its links begin at the root
            base = folder if parts.path.startswith("/") else path.parent
            target = (base / unquote(parts.path).lstrip("/")).resolve() if parts.path else path
            if target.is_dir():
                target = target / "index.html"
            if not target.is_file():
                wrong.append(f"{path.relative_to(folder)}: no {address}")
            elif target in pages and unquote(parts.fragment) not in pages[target].anchors:
                wrong.append(f"{path.relative_to(folder)}: no anchor {address}")
    for path in sorted(folder.rglob("*.css")):
        wrong += [
            f"{path.relative_to(folder)}: fetches {address}"
            for address in re.findall(r"url\(['\"]?(https?:[^)'\"]+)", path.read_text(encoding="utf-8"))
        ]
    return wrong


def sources(root: Path) -> list[str]:
    """The same for relative links of README.md, emsim/README.md and netlists/**/*.md, as a forge shows them."""
    wrong = []
    for path in [
        root / "README.md",
        root / "emsim" / "README.md",
        *sorted((root / "netlists").rglob("*.md")),
    ]:
        text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
        for address in re.findall(r"\]\(([^)\s]+)\)", text):
            parts = urlsplit(address)
            if parts.scheme:
                continue
            target = path.parent / unquote(parts.path) if parts.path else path
            if not target.exists():
                wrong.append(f"{path.relative_to(root)}: no {address}")
            elif parts.fragment and parts.fragment not in headings(target.read_text(encoding="utf-8")):
                wrong.append(f"{path.relative_to(root)}: no heading {address}")
    return wrong


def headings(text: str) -> set[str]:
    """Anchors that a forge makes of Markdown's headings."""
    text = re.sub(r"^```.*?^```$", "", text, flags=re.M | re.S)
    return {
        re.sub(r"[^\w\- ]", "", title.strip().lower()).replace(" ", "-")
        for title in re.findall(r"^#+ (.*)$", text, re.M)
    }
