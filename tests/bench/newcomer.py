"""A newcomer's path, done and timed: from an empty folder to a page in the browser, a first mistake and its fix.

    python tests/bench/newcomer.py [--keep FOLDER]

Everything happens in a new folder: the tree is cloned, an environment made, emsim compiled and installed as the README says;
a deck is run and its page opened in headless Chromium (where there is one) until its curves stand; a template is edited
with two slips of the pen and mended by what the messages say. Wall seconds, one run: compiling depends on the machine and
on whether cargo and pip have their downloads. Exit code 1 where a step does not do what it should.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DECK = "netlists/paper/motor_pendulum_kp30.cir"
# what the newcomer types wrongly into the template, and what the messages must say to type instead
SLIPS = [("JOINT hinge 0 arm pin", "JOINT hinge 0 amr pin", "arm"), ("damp=2m", "dapm=2m", "damp=")]


class Steps:
    """The steps done so far with their times."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.steps: list[tuple[str, float]] = []

    def do(self, what: str, *command: object, code: int = 0, cwd: Path | None = None) -> str:
        """Runs a command and notes its time; what it printed. SystemExit where it ends otherwise than it should."""
        began = time.perf_counter()
        env = {
            k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV", "CARGO_TARGET_DIR")
        }
        done = subprocess.run(
            [str(word) for word in command], cwd=cwd or self.folder, env=env, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        self.steps.append((what, time.perf_counter() - began))
        if done.returncode != code:
            print(done.stdout[-3000:], file=sys.stderr)
            raise SystemExit(f"{what}: exit code {done.returncode} in place of {code}")
        return done.stdout

    def table(self) -> str:
        rows = [f"| {what} | {seconds:.{0 if seconds >= 10 else 2}f} s |" for what, seconds in self.steps]
        return "\n".join(["| step | time |", "|---|---|", *rows])


def drawn(page: Path) -> float | None:
    """Seconds until a browser shows the page's curves; None without a browser."""
    chromium = next((path for name in ("chromium", "chromium-browser") if (path := shutil.which(name))), None)
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        chromium = None
    if chromium is None:
        return None
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=chromium, args=["--no-sandbox", "--disable-gpu"])
        tab = browser.new_page()
        began = time.perf_counter()
        tab.goto(page.as_uri())
        tab.wait_for_selector("canvas")
        seconds = time.perf_counter() - began
        browser.close()
    return seconds


def mend(path: Path) -> str:
    """What a newcomer does with a message: types at the marked place what its help says. Returns the word typed."""
    said = (path.parent / "said.txt").read_text(encoding="utf-8")
    place = re.search(r"--> \S+?:(\d+):(\d+)\n[\s\S]*?\n +\|( +)(\^+)\n[\s\S]*?did you mean (\S+?)\?", said)
    if place is None:
        raise SystemExit(f"the message does not say what to type:\n{said}")
    row, col, marks, word = int(place[1]), int(place[2]), len(place[4]), place[5]
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    line = lines[row - 1]
    wrong = line[col - 1 : col - 1 + marks]
    # a parameter is marked with its value
    right = word + wrong.partition("=")[2] if word.endswith("=") else word
    lines[row - 1] = line[: col - 1] + right + line[col - 1 + marks :]
    path.write_text("".join(lines), encoding="utf-8")
    return word


def edit(steps: Steps, emsim: object, work: Path) -> None:
    """A template with slips of the pen, mended message by message."""
    steps.do(
        "a deck of one's own: `emsim new arm -t pendulum`", emsim, "new", "arm", "-t", "pendulum", cwd=work
    )
    deck = work / "arm.cir"
    text = deck.read_text(encoding="utf-8")
    for right, wrong, _ in SLIPS:
        if right not in text:
            raise SystemExit(f"the template has no {right!r}")
        text = text.replace(right, wrong)
    deck.write_text(text, encoding="utf-8")
    wanted = {word for _, _, word in SLIPS}
    for k in range(len(SLIPS)):
        name = ("a mistake and its message", "mended as it says; the next message")[k]
        said = steps.do(f"{name}: `emsim arm.cir`", emsim, "arm.cir", code=1, cwd=work)
        (work / "said.txt").write_text(said, encoding="utf-8")
        wanted.remove(mend(deck))
    steps.do("mended, it runs: `emsim arm.cir`", emsim, "arm.cir", cwd=work)
    if wanted:
        raise SystemExit(f"no message asked for {wanted}")


def install(steps: Steps) -> tuple[Path, Path]:
    """Clone, environment, compilation; the program and the tree."""
    steps.do("clone", "git", "clone", "-q", "--no-local", ROOT, "emsim")
    tree = steps.folder / "emsim"
    steps.do("`python3 -m venv .venv`", sys.executable, "-m", "venv", ".venv", cwd=tree)
    bin = tree / ".venv" / ("Scripts" if os.name == "nt" else "bin")
    steps.do("`.venv/bin/pip install .`, the engine is compiled", bin / "pip", "install", "-q", ".", cwd=tree)
    return bin / "emsim", tree


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--keep", type=Path, help="an empty folder to work in, which stays")
    given = parser.parse_args()
    folder = given.keep.resolve() if given.keep else Path(tempfile.mkdtemp(prefix="newcomer-"))
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise SystemExit(f"{folder} is not empty")
    steps = Steps(folder)
    try:
        emsim, tree = install(steps)
        steps.do(f"first command: `emsim {DECK}`", emsim, DECK, cwd=tree)
        page = folder / "page.html"
        steps.do(f"its page: `emsim view {DECK}`", emsim, "view", "--no-open", "-o", page, DECK, cwd=tree)
        if (seconds := drawn(page)) is not None:
            steps.steps.append(("the page stands in the browser", seconds))
        edit(steps, emsim, tree)
    finally:
        if not given.keep:
            shutil.rmtree(folder, ignore_errors=True)
    print(steps.table())
    print(f"\ntogether {sum(seconds for _, seconds in steps.steps):.0f} s")


if __name__ == "__main__":
    main()
