"""Builds the docs site strictly and checks every link of it: python emsim/docs/build.py [folder]

Needs the extra `docs`: pip install 'emsim[docs]'. The site goes to build/site, or to the folder named; open its
index.html, no server is needed. Exit code 1 where mkdocs warns or a link leads nowhere.
"""

from __future__ import annotations

import logging
import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(HERE))

import links  # noqa: E402


def build(folder: Path) -> list[str]:
    """Writes the site; what is wrong with it, one line each."""
    # the theme's advertisement; mkdocs 1 and this theme are pinned in pyproject.toml
    os.environ["NO_MKDOCS_2_WARNING"] = "1"
    # its first run on a machine says that it looks for fonts
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    from mkdocs.commands.build import build as write
    from mkdocs.config import load_config
    from mkdocs.exceptions import Abort

    config = load_config(str(HERE / "mkdocs.yml"), site_dir=str(folder), strict=True)
    config.plugins.run_event("startup", command="build", dirty=False)
    try:
        write(config)
    except Abort as stop:
        return [str(stop)]
    finally:
        config.plugins.run_event("shutdown")
    return links.site(folder) + links.sources(ROOT)


if __name__ == "__main__":
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s: %(message)s")
    target = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "build" / "site"
    wrong = build(target)
    print("\n".join(wrong) if wrong else f"site: {target / 'index.html'}")
    sys.exit(1 if wrong else 0)
