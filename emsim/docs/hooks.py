"""What mkdocs calls while it builds the site (mkdocs.yml names this file): pages that are generated, formulas, decks, runs.

Nothing generated stands in the tree: the reference comes from the cards' specs and the program's own tables, lessons and
decks from netlists/, the machines that move from running these decks.
"""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

import decklexer
import reference
import tree
from latex2mathml.converter import convert
from mkdocs.structure.files import File

TYPE_CHECKING = False
if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files
    from mkdocs.structure.pages import Page

decklexer.register()


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds what is generated to the files of pages/."""
    for address, text in {**reference.pages(), **tree.pages()}.items():
        files.append(File.generated(config, address, content=text))
    for address, path in tree.downloads().items():
        files.append(File.generated(config, address, abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """`<!-- deck PATH -->` shows a deck of netlists/, `<!-- run PATH -->` its page, with the machine moving
    (`<!-- run PATH K -->`: of a lesson's K-th edit),
    `<!-- circuit PATH -->` its circuit, and `<!-- chart PATH -->` its work-precision chart."""
    markdown = re.sub(r"<!-- deck (\S+) -->", lambda m: tree.shown(m[1]), markdown)
    markdown = re.sub(
        r"<!-- run (\S+)(?: (\d+))? -->", lambda m: tree.frame(m[1], int(m[2] or 0), page.url), markdown
    )
    return re.sub(r"<!-- (circuit|chart) (\S+) -->", lambda m: tree.picture(m[1], m[2], page.url), markdown)


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Formulas become MathML, which browsers draw without help."""

    def formula(found: re.Match[str]) -> str:
        text = unescape(found[2]).strip()
        block = text.startswith("\\[")
        return convert(text[2:-2].strip(), display="block" if block else "inline")

    return re.sub(r'<(span|div) class="arithmatex">(.*?)</\1>', formula, html, flags=re.S)


def on_post_build(config: MkDocsConfig) -> None:
    """The pages of the runs that pages of the site showed, and the pictures."""
    tree.write_runs(Path(config.site_dir))
    tree.write_pictures(Path(config.site_dir))
