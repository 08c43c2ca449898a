"""Writes the table of decks into netlists/README.md, from the comments at the head of each deck.

python netlists/index.py          rewrite the table
python netlists/index.py --check  exit 1 if it is out of date
"""

import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
START, END = "<!-- decks: written by index.py -->", "<!-- end of decks -->"
FOLDERS = {
    "lessons": "From an RC to a balanced cart-pole; read [the lessons](lessons/README.md)",
    "paper": "The paper's experiments",
    "coupled": "Circuit and machine together",
    "mechanical": "Machines",
    "electrical": "Plain SPICE, compared with ngspice",
    "bench": "For their cost: the rest of the benchmark set (`python tests/bench/suite.py`)",
    "hard": "Decks on which methods fail",
}


def head(path: Path) -> tuple[str, dict[str, str]]:
    """Title, and the text after `* Teaches:` and `* Checked against:` with its continuation lines."""
    lines = path.read_text(encoding="utf-8").splitlines()
    said: dict[str, str] = {}
    key = ""
    for line in lines[1:]:
        if not line.startswith("*"):
            break
        text = line[1:].strip()
        found = re.match(r"(Teaches|Checked against):\s*(.*)", text)
        if found:
            key, text = found.groups()
            said[key] = text
        elif key:
            said[key] += " " + text
    return lines[0], said


def table() -> str:
    out = []
    for folder, title in FOLDERS.items():
        decks = sorted((HERE / folder).glob("*.cir"))
        if not decks:
            continue
        out += [
            f"### {folder}/: {title}",
            "",
            "| deck | what it is, what it teaches | checked against |",
            "|---|---|---|",
        ]
        for deck in decks:
            name, said = head(deck)
            cells = [
                f"[{deck.stem}]({folder}/{deck.name})",
                f"**{name}.** {said.get('Teaches', '')}".strip(),
                said.get("Checked against", ""),
            ]
            out.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
        out.append("")
    return "\n".join(out)


def main() -> int:
    readme = HERE / "README.md"
    text = readme.read_text(encoding="utf-8")
    before, _, rest = text.partition(START)
    _, _, after = rest.partition(END)
    fresh = f"{before}{START}\n\n{table()}\n{END}{after}"
    if "--check" in sys.argv:
        return int(fresh != text)
    readme.write_text(fresh, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
