"""A deck's equations written down: as text, as a LaTeX document, as a sheet of the run's page in MathML."""

from __future__ import annotations

from html import escape

from . import notation
from .equations import BRANCHES, CIRCUIT, CLOSURE, CONSTANT, MOTION, OTHERS, Energy, Explained, Part, Row
from .notation import latex_text

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any

    from ..assemble.recording import Placed
    from ..outputs.html import Sheet
    from .algebra import Poly
    from .notation import Tree

SECTIONS = (
    (
        MOTION,
        "Motion",
        "the rate of a momentum is the sum of the forces along its coordinate: Lagrange's equations",
    ),
    (
        CLOSURE,
        "Closed loops",
        "what the last joint of a loop demands of the others, and its rate; the multipliers make them true",
    ),
    (CIRCUIT, "Nodes", "the currents that leave a node add up to zero: Kirchhoff's current law"),
    (BRANCHES, "Branches", "what holds between the ends of a source, a coil, a motor"),
    (OTHERS, "Derivatives and integrals", "unknowns of their own"),
)
ENERGIES = (
    ("T", "kinetic energy", "J"), ("V", "potential energy", "J"), ("W", "energy of fields", "J"), ("P", "heat", "W"),
)  # fmt: skip
INDEX = {
    0: "an ordinary differential equation",
    1: "the algebraic equations determine their unknowns",
    2: "some algebraic equations determine their unknowns only when they are differentiated once",
    3: "some algebraic equations determine their unknowns only when they are differentiated twice",
}
CONDITIONS = "each is held until a run has found the instant at which it changes"
WIDTH = 44  # of a column of formulas; longer ones push their remark on


def facts(x: Explained) -> Iterator[str]:
    """How many equations of which kind, in sentences."""
    rates = sum(x.system.differential_rows)
    yield (
        f"{x.size} unknowns, {x.size} equations: {rates} {'has' if rates == 1 else 'have'} a time derivative, "
        f"{x.size - rates} {'is' if x.size - rates == 1 else 'are'} algebraic"
    )
    if x.freedom is not None:
        yield f"{x.freedom} {'degree' if x.freedom == 1 else 'degrees'} of freedom"
    if x.index is not None:
        yield f"index {x.index}: {INDEX[x.index]}"


def _sentence(words: str) -> str:
    return words[0].upper() + words[1:]


def sections(x: Explained) -> Iterator[tuple[str, str, list[Row]]]:
    """(title, what it says, rows) of all that have rows."""
    for key, title, remark in SECTIONS:
        rows = [row for row in x.rows if row.section == key]
        if rows:
            yield title, remark, rows


def term(x: Explained, part: Part) -> Tree:
    """A summand as a tree; a constant stands before the time derivative."""
    node = x.layout.tree(part.poly, part.quotient)
    if not part.rate:
        return node
    if node[0] == "sum" and len(node[1]) == 1:
        return notation.negated(_rate(node[1][0][1]))
    return _rate(node)


def _rate(node: Tree) -> Tree:
    if node[0] == "prod" and node[1][0][0] == "num":
        rest = node[1][1:]
        return ("prod", [node[1][0], ("rate", rest[0] if len(rest) == 1 else ("prod", rest))])
    return ("rate", node)


def formula(x: Explained, e: Energy) -> Tree:
    """An energy, or a heat."""
    return x.layout.tree(e.poly, e.word == "R")


def signed(node: Tree) -> tuple[int, Tree]:
    """(sign, rest) of a summand, for a sum that is written one summand a line."""
    if node[0] == "sum" and node[1][0][0] < 0:
        return -1, (node[1][0][1] if len(node[1]) == 1 else ("sum", [(1, node[1][0][1]), *node[1][1:]]))
    return 1, node


def comparison(x: Explained, up: Poly) -> tuple[Tree, Tree]:
    """What is above zero as (what depends on unknowns, what it is above)."""
    constant = up.terms.get((), 0.0)
    moving = x.algebra.poly({m: c for m, c in up.terms.items() if m})
    return x.layout.tree(moving), ("num", abs(constant)) if constant <= 0 else (
        "sum",
        [(-1, ("num", constant))],
    )


def conditions(x: Explained) -> Iterator[tuple[str, tuple[Tree, Tree], tuple[Tree, Tree] | None, str]]:
    """Name, what is above what, what is below what at its end, remark."""
    for name, up, down, remark in x.conditions:
        yield name, comparison(x, up), None if down is None else comparison(x, down), remark


def data(x: Explained) -> dict[str, Any]:
    """Everything as plain data, formulas as text."""
    write = lambda poly: notation.text(x.layout.tree(poly), x.names)  # noqa: E731

    def side(parts: list[Part]) -> list[dict[str, str]]:
        return [
            {"formula": notation.text(term(x, p), x.names), "owner": p.owner, "what": p.note} for p in parts
        ]

    return {
        "title": x.title, "size": x.size, "degrees_of_freedom": x.freedom, "index": x.index,
        "unknowns": [{"name": n, "unit": u, "meaning": m} for n, u, m in x.unknowns],
        "energies": [
            {"kind": e.kind, "owner": e.owner, "card": e.word, "formula": write(e.poly), "law": e.law} for e in x.energies
        ],
        "equations": [
            {"row": r.index, "section": r.section, "title": r.title, "left": side(r.left), "right": side(r.right)} for r in x.rows
        ],
        "left_out": x.left_out,
        "where": {name: notation.text(x.layout.written(atom), x.names) for name, atom in x.named},
        "sources": dict(x.sources),
        "conditions": [
            {"name": n, "above_zero": write(up), "below_zero": None if down is None else write(down), "remark": remark}
            for n, up, down, remark in x.conditions
        ],
        "folded": x.folded,
    }  # fmt: skip


# ---- text -----------------------------------------------------------------------------------------


def page(x: Explained) -> Iterator[str]:
    """For the terminal."""
    write = lambda node: notation.text(node, x.names)  # noqa: E731
    yield x.title
    yield ""
    for fact in facts(x):
        yield f"  {fact}"
    yield ""
    yield "Unknowns"
    yield from _columns([(name, unit or "-", meaning) for name, unit, meaning in x.unknowns])
    if x.size > len(x.unknowns):
        yield f"  ... and {x.size - len(x.unknowns)} more"
    if x.energies:
        yield ""
        yield "Energies"
        for letter, title, unit in ENERGIES:
            found = [e for e in x.energies if e.kind == letter]
            if found:
                yield f"  {title} {letter} [{unit}]"
                yield from _columns([(e.owner, write(formula(x, e)), e.law) for e in found], "    ")
    for title, remark, rows in sections(x):
        yield ""
        yield f"{title}: {remark}"
        for row in rows:
            yield from _row(x, row)
    if x.left_out:
        yield ""
        yield f"... and {x.left_out} more equations; emsim explain deck.cir:LINE writes those of one line"
    definitions = [f"{name} = {write(x.layout.written(atom))}" for name, atom in x.named]
    definitions += [f"{name} = {what}" for name, what in x.sources]
    definitions += [line for d in x.devices for line in device_text(x, d)]
    if definitions:
        yield ""
        yield "Where"
        for line in definitions:
            yield from _broken(line, "  ")
    if x.conditions:
        yield ""
        yield f"Conditions: {CONDITIONS}"
        rows_ = []
        for name, (left, right), end, remark in conditions(x):
            said = f"{write(left)} > {write(right)}"
            if end is not None:
                said += f", until {write(end[0])} < {write(end[1])}"
            rows_.append((name, said, remark))
        yield from _columns(rows_)
    if x.folded:
        yield ""
        yield "Folded away"
        for line in x.folded:
            yield from _broken(line, "  ")


def _row(x: Explained, row: Row) -> Iterator[str]:
    left, right = _lines(x, row.left), _lines(x, row.right)
    if len({note for _, note in (*left, *right)}) == 1 and len(left) > 1:
        left = [(" ".join(formula for formula, _ in left), left[0][1])]
    titled = row.title not in ("", *(note for _, note in (*left, *right)))
    short = max(len(left), len(right)) <= 1 and sum(len(s) for s, _ in (*left, *right)) < 100
    if short:
        notes = dict.fromkeys(note for _, note in (*left, *right))
        formula = f"{_side(left)} = {_side(right)}"
        label = row.title if row.section in (BRANCHES, CLOSURE, CIRCUIT) else ""
        yield f"  {formula:<{WIDTH + 2}}  {label or ', '.join(notes)}".rstrip()
        return
    if titled:
        yield f"  {row.title}"
    yield from _stack(left, "      ", "      ")
    if right:
        yield from _stack(right, "      = ", "        ")
    else:
        yield "      = 0"


def _stack(lines: list[tuple[str, str]], first: str, later: str) -> Iterator[str]:
    for k, (formula, note) in enumerate(lines):
        head = first if k == 0 else later
        shown = formula.removeprefix("+ ") if k == 0 else formula
        pieces = list(_broken(shown, head, hang="    "))
        yield from pieces[:-1]
        yield f"{pieces[-1]:<{WIDTH + 4}}  {note}".rstrip()


def _lines(x: Explained, parts: Iterable[Part]) -> list[tuple[str, str]]:
    """(formula with its sign, whose it is)"""
    found = []
    for part in parts:
        sign, node = signed(term(x, part))
        found.append((("- " if sign < 0 else "+ ") + notation.text(node, x.names), part.note))
    return found


def _side(lines: list[tuple[str, str]]) -> str:
    if not lines:
        return "0"
    formula = lines[0][0].removeprefix("+ ")
    return "-" + formula[2:] if formula.startswith("- ") else formula


def _columns(rows: list[tuple[str, str, str]], margin: str = "  ") -> Iterator[str]:
    """Three columns; a long entry does not push the others away."""
    first = max((len(r[0]) for r in rows), default=0)
    second = max((len(r[1]) for r in rows if len(r[1]) <= WIDTH), default=0)
    for a, b, c in rows:
        pieces = list(_broken(b, f"{margin}{a:<{first}}  ", hang="    ")) or [f"{margin}{a}"]
        yield from pieces[:-1]
        yield f"{pieces[-1]:<{len(margin) + first + 2 + second}}  {c}".rstrip()


def _broken(line: str, margin: str, hang: str = "  ", width: int = 116) -> Iterator[str]:
    """A line broken before + and - of a sum, or at blanks, where it is too long."""
    head = margin
    while len(head) + len(line) > width:
        room = width - len(head)
        cut = max(line.rfind(" + ", 20, room), line.rfind(" - ", 20, room))
        cut = cut if cut > 0 else line.rfind(" ", 20, room)
        if cut <= 0:
            break
        yield (head + line[:cut]).rstrip()
        line, head = line[cut + 1 :], " " * len(margin) + hang
    yield head + line


def device_text(x: Explained, d: Placed) -> Iterator[str]:
    """What i_d1 is: the law of a junction, as far as a line can say it; of others between which nodes their currents go."""
    if d.kind != "d":
        for branch, (p, n, stores) in enumerate(d.branches):
            u = notation.text(x.layout.tree(_drop(x, p, n)), x.names)
            what = "current and charge" if stores else "current"
            names = f"i{d.number(branch)}_{d.name}" + (f", q{d.number(branch)}_{d.name}" if stores else "")
            yield f"{names} = {what} of {d.name} ({d.kind}) along {u}"
        return
    p, n, stores = d.branches[0]
    u = notation.text(_bracketed(x.layout.tree(_drop(x, p, n))), x.names)
    saturation, slope = d.model.get("is", d.model.get("js", 1e-14)), d.model.get("n", 1.0)
    saturation *= d.instance.get("area", 1.0) * d.instance.get("m", 1.0)
    vt = 8.617333262e-5 * (d.temp + 273.15)
    warm = (
        f", is = {saturation:g} A at {d.tnom:g} C as SPICE carries it to {d.temp:g} C"
        if d.temp != d.tnom
        else ""
    )
    yield (
        f"i_{d.name} = {'is' if warm else f'{saturation:g}'}*(exp({u}/{slope * vt:.4g}) - 1): the junction of {d.name}{warm}"
        + (", with its breakdown" if d.model.get("bv") else "")
    )
    if stores:
        yield f"q_{d.name} = the charge of that junction"


def _bracketed(node: Tree) -> Tree:
    return ("prod", [node]) if node[0] == "sum" else node


def _drop(x: Explained, p: int, n: int) -> Poly:
    a = x.algebra
    return a.sum((s, a.x(k)) for s, k in ((1.0, p), (-1.0, n)) if k >= 0)


# ---- LaTeX ----------------------------------------------------------------------------------------

HEAD = r"""\documentclass{article}
\usepackage[a4paper,margin=20mm]{geometry}
\usepackage{amsmath}
\setlength{\parindent}{0pt}
\allowdisplaybreaks
\begin{document}
"""


def latex(x: Explained) -> Iterator[str]:
    """A whole document."""
    write = lambda node: notation.latex(node, x.names)  # noqa: E731
    yield HEAD + rf"\section*{{{latex_text(x.title)}}}"
    yield ".\n".join(latex_text(_sentence(fact)) for fact in facts(x)) + "."
    yield r"\subsection*{Unknowns}" + "\n" + r"\begin{tabular}{lll}"
    for i, (_, unit, meaning) in enumerate(x.unknowns):
        symbol = write(("sym", next(iter(x.algebra.x(i).atoms()))))
        yield rf"${symbol}$ & {latex_text(unit)} & {latex_text(meaning)} \\"
    yield r"\end{tabular}"
    if x.energies:
        yield r"\subsection*{Energies}" + "\n" + r"\begin{align*}"
        lines = [
            rf"{letter}_{{\mathrm{{{latex_text(e.owner)}}}}} &= \textstyle {write(formula(x, e))} && \text{{{title}}}"
            for letter, title, _ in ENERGIES for e in x.energies if e.kind == letter
        ]  # fmt: skip
        yield " \\\\\n".join(lines)
        yield r"\end{align*}"
    for title, remark, rows in sections(x):
        yield rf"\subsection*{{{title}}}" + "\n" + latex_text(_sentence(remark)) + "."
        yield r"\begin{align*}"
        yield " \\\\[4pt]\n".join(" \\\\\n".join(_latex_row(x, row)) for row in rows)
        yield r"\end{align*}"
    where = [rf"{name[0]}_{{{name[2:]}}} &= {write(x.layout.written(atom))}" for name, atom in x.named]
    where += [
        rf"{write(('sym', atom))} &= \text{{{latex_text(what)}}}"
        for atom, what in zip(_wave_atoms(x), (what for _, what in x.sources), strict=True)
    ]
    if where:
        yield r"\subsection*{Where}" + "\n" + r"\begin{align*}"
        yield " \\\\\n".join(where)
        yield r"\end{align*}"
    for d in x.devices:
        for line in device_text(x, d):
            yield latex_text(line) + r"\\"
    if x.conditions:
        yield r"\subsection*{Conditions}" + "\n" + latex_text(_sentence(CONDITIONS)) + "."
        yield r"\begin{align*}"
        lines = []
        for name, (left, right), end, remark in conditions(x):
            said = rf"c_{{{name[1:]}}}\colon\quad & {write(left)} > {write(right)}"
            if end is not None:
                said += rf"\text{{, until }} {write(end[0])} < {write(end[1])}"
            lines.append(said + rf" && \text{{{latex_text(remark)}}}")
        yield " \\\\\n".join(lines)
        yield r"\end{align*}"
    if x.folded:
        yield r"\subsection*{Folded away}" + "\n" + r"\begin{itemize}"
        for line in x.folded:
            yield rf"\item {latex_text(line)}"
        yield r"\end{itemize}"
    yield r"\end{document}"


def _wave_atoms(x: Explained) -> list[Any]:
    """The symbols of the sources that are listed."""
    numbers = [k for k, (kind, _, _) in enumerate(x.recorder.waves[: x.MOST_ROWS]) if kind not in CONSTANT]
    return [next(iter(x.algebra.atom("wave", k).atoms())) for k in numbers]


def _latex_row(x: Explained, row: Row) -> Iterator[str]:
    """Lines of an align: the left side, then a summand a line with whose it is."""
    left, right = row.left, row.right
    if not right:  # all on one side: = 0 at the end
        for k, part in enumerate(left):
            sign, node = signed(term(x, part))
            head = ("-" if sign < 0 else "") if k == 0 else ("- " if sign < 0 else "+ ")
            end = " = 0" if k == len(left) - 1 else ""
            yield rf"& {head}{notation.latex(node, x.names)}{end} && \text{{{latex_text(part.note)}}}"
        if not left:
            yield "& 0 = 0"
        return
    start = " ".join(_latex_terms(x, left)) or "0"
    for k, part in enumerate(right):
        sign, node = signed(term(x, part))
        head = ("-" if sign < 0 else "") if k == 0 else (r"\quad - " if sign < 0 else r"\quad + ")
        note = part.note if len(right) > 1 else row.title
        before = f"{start} &= " if k == 0 else "&"
        yield rf"{before}{head}{notation.latex(node, x.names)} && \text{{{latex_text(note)}}}"


def _latex_terms(x: Explained, parts: list[Part]) -> Iterator[str]:
    for k, part in enumerate(parts):
        sign, node = signed(term(x, part))
        yield ("-" if sign < 0 else "" if k == 0 else "+ ") + notation.latex(node, x.names)


# ---- a sheet of the page --------------------------------------------------------------------------


def sheets(x: Explained) -> list[Sheet]:
    """What `outputs.html.write` takes beside a run."""
    from ..outputs.html import packed_sheet

    return [packed_sheet("equations", "Equations", sheet(x))]


def sheet(x: Explained) -> str:
    """HTML with MathML, without styles and scripts."""

    def math(node: Tree) -> str:
        return f'<math display="inline"><mstyle displaystyle="true">{notation.mathml(node, x.names)}</mstyle></math>'

    out = [
        '<div class="equations">',
        "<p>" + ". ".join(escape(_sentence(fact)) for fact in facts(x)) + ".</p>",
    ]
    for title, remark, rows in sections(x):
        out.append(f"<h3>{title}</h3><p class=say>{escape(remark)}</p><table>")
        out += [_html_row(x, row, math) for row in rows]
        out.append("</table>")
    if x.left_out:
        out.append(f"<p>... and {x.left_out} more equations.</p>")
    where = [
        f"<tr><td>{math(('name', name))}</td><td>=</td><td>{math(x.layout.written(atom))}</td><td></td></tr>"
        for name, atom in x.named
    ]
    where += [
        f"<tr><td>{math(('sym', atom))}</td><td>=</td><td><code>{escape(what)}</code></td><td></td></tr>"
        for atom, (_, what) in zip(_wave_atoms(x), x.sources, strict=True)
    ]
    if where or x.devices:
        out.append(f"<h3>Where</h3><table>{''.join(where)}</table>")
        out += [f"<p><code>{escape(line)}</code></p>" for d in x.devices for line in device_text(x, d)]
    if x.energies:
        out.append("<h3>Energies</h3><table>")
        for letter, title, unit in ENERGIES:
            for e in x.energies:
                if e.kind == letter:
                    law = f" <code>{escape(e.law)}</code>" if e.law else ""
                    symbol = f"<math><msub><mi>{letter}</mi><mtext>{escape(e.owner)}</mtext></msub></math>"
                    out.append(
                        f"<tr><td>{symbol}</td><td>=</td><td>{math(x.layout.tree(e.poly, e.word == 'R'))}</td>"
                        f"<td>{title} [{unit}]{law}</td></tr>"
                    )
        out.append("</table>")
    if x.conditions:
        out.append(f"<h3>Conditions</h3><p class=say>{escape(CONDITIONS)}</p><table>")
        for name, (a, b), end, remark in conditions(x):
            until = "" if end is None else f" until {math(end[0])} &lt; {math(end[1])}"
            symbol = f"<math><msub><mi>c</mi><mn>{name[1:]}</mn></msub></math>"
            out.append(
                f"<tr><td>{symbol}</td><td></td><td>{math(a)} &gt; {math(b)}{until}</td><td>{escape(remark)}</td></tr>"
            )
        out.append("</table>")
    out.append("<h3>Unknowns</h3><table>")
    for i, (name, unit, meaning) in enumerate(x.unknowns):
        symbol = math(("sym", next(iter(x.algebra.x(i).atoms()))))
        out.append(
            f"<tr><td>{symbol}</td><td></td><td><code>{escape(name)}</code> {escape(unit)}</td><td>{escape(meaning)}</td></tr>"
        )
    out.append("</table>")
    if x.folded:
        out.append(
            "<h3>Folded away</h3><ul>" + "".join(f"<li>{escape(line)}</li>" for line in x.folded) + "</ul>"
        )
    return "".join([*out, "</div>"])


def _html_row(x: Explained, row: Row, math: Any) -> str:
    """One equation as rows of a table: left side, =, a summand, whose it is."""
    right = row.right or [Part("", x.algebra.zero)]
    left, lines = row.left, []
    if not row.right and len(left) > 1:
        # all on one side: a summand a line, = 0 at the end
        for k, part in enumerate(left):
            sign, node = signed(term(x, part))
            sign_shown = "\u2212" if sign < 0 else "+" if k else ""
            zero = " = 0" if k == len(left) - 1 else ""
            title = f"<b>{escape(row.title)}</b>" if k == 0 else ""
            lines.append(
                f"<tr><td>{title}</td><td>{sign_shown}</td><td>{math(node)}{zero}</td><td>{escape(part.note)}</td></tr>"
            )
        return f"<tbody>{''.join(lines)}</tbody>"
    trees = [term(x, part) for part in left]
    start = (
        trees[0]
        if len(trees) == 1
        else ("sum", [pair for t in trees for pair in (t[1] if t[0] == "sum" else [(1, t)])])
    )
    for k, part in enumerate(right):
        sign, node = signed(term(x, part)) if part.poly.terms else (1, ("num", 0.0))
        sign_shown = ("= \u2212" if sign < 0 else "=") if k == 0 else ("\u2212" if sign < 0 else "+")
        note = part.note if len(right) > 1 else row.title
        lines.append(
            f"<tr><td>{math(start) if k == 0 else ''}</td><td>{sign_shown}</td><td>{math(node)}</td><td>{escape(note)}</td></tr>"
        )
    return f"<tbody>{''.join(lines)}</tbody>"
