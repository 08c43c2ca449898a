"""Writes the tables of the grammars for the engine's own parser: emsim/engine/syntax/src/tables.txt for decks,
emsim/engine/veriloga/src/tables.txt for Verilog-A.

python grammar/export.py          rewrite the files
python grammar/export.py --check  exit 1 if one is out of date

The grammar in grammar/*.lark stays the only source of the syntax. Lark computes everything here: the LALR(1)
actions, the terminals that its contextual lexer looks for in each state, in Lark's order (priority, longest
possible match, length of the pattern, name), which keyword a word turns into ("unless"), and how a rule's symbols
become children. Regular expressions are taken apart by Python's own `re`, so that the engine's matcher means the
same by each of them. States are renumbered along their transitions: the file depends on the grammar alone.

The format: a line with the count opens each section, one line an item. See emsim/engine/syntax/src/table.rs.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ENGINE = HERE.parent / "emsim" / "engine"
sys.path.insert(0, str(HERE.parent))

from lark import Lark  # noqa: E402
from lark.lexer import PatternRE, PatternStr, _create_unless  # noqa: E402
from lark.parsers.lalr_analysis import Shift  # noqa: E402

from emsim import lark_grammar  # noqa: E402

NON_ASCII = "".join(map(chr, (*range(0x80, 0xD800), *range(0xE000, 0x10000))))
# whether these are letters or digits will not change with Unicode's versions: Latin, small and capital Greek
SETTLED = "".join(map(chr, (*range(0x80, 0x250), *range(0x391, 0x3CA))))
INFINITE = re._parser.MAXREPEAT


class Patterns:
    """Regular expressions in the engine's notation:

    n          one character of class n           $        the end of the text
    ( a | b )  alternatives, the first that fits   = a, ! a  followed by a, not followed by a
    * m n g a  a repeated m to n times (`-`: any number), `g` as often, `l` as rarely as possible
    """

    def __init__(self) -> None:
        self.classes: dict[str, int] = {}
        self._known: dict[tuple[str, int], str] = {}

    def notation(self, regexp: str) -> str:
        tree = re._parser.parse(regexp)
        return " ".join(self._sequence(tree, tree.state.flags & re.I))

    def _sequence(self, items, flags: int) -> list[str]:
        return [word for item in items for word in self._item(item, flags)]

    def _item(self, item, flags: int) -> list[str]:
        kind, value = str(item[0]), item[1]
        if kind in ("LITERAL", "NOT_LITERAL", "IN", "ANY"):
            return [str(self._class(item, flags))]
        if kind in ("MAX_REPEAT", "MIN_REPEAT"):
            least, most, body = value
            if body.getwidth()[0] == 0:
                raise SystemExit("a repeated pattern may not be empty: the engine's matcher would not end")
            greedy = "g" if kind == "MAX_REPEAT" else "l"
            return [
                "*",
                str(least),
                "-" if most == INFINITE else str(most),
                greedy,
                *self._group([body], flags),
            ]
        if kind == "SUBPATTERN":
            _, more, less, body = value
            return self._group([body], (flags | more) & ~less & re.I)
        if kind == "BRANCH":
            return self._group(value[1], flags)
        if kind in ("ASSERT", "ASSERT_NOT"):
            direction, body = value
            if direction < 0:
                raise SystemExit("the engine's matcher does not look behind")
            return ["=" if kind == "ASSERT" else "!", *self._group([body], flags)]
        if kind == "AT" and str(value) == "AT_END":
            return ["$"]
        raise SystemExit(f"the engine's matcher has no {kind} {value}")

    def _group(self, branches, flags: int) -> list[str]:
        words = [self._sequence(branch, flags) for branch in branches]
        if len(words) == 1 and len(words[0]) == 1:
            return words[0]
        out = ["("]
        for k, sequence in enumerate(words):
            out += ["|"] * (k > 0) + sequence
        return [*out, ")"]

    def _class(self, item, flags: int) -> int:
        """A class of characters: ASCII as 128 bits; the rest is in (`+`) or out (`-`) with the ranges of exceptions,
        or `?`: what is in of SETTLED; of others Unicode's versions think differently, so Lark is asked."""
        key = (repr(item), flags)
        if key not in self._known:
            text = repr(item)
            one = re._parser.SubPattern(re._parser.State(), [item])
            pattern = re._compiler.compile(one, flags | re.UNICODE)
            mask = sum(1 << c for c in range(128) if pattern.fullmatch(chr(c)))
            if re.search(r"CATEGORY_(NOT_)?(WORD|DIGIT)", text):
                known = [ord(c) for c in pattern.findall(SETTLED)]
                rest = "?" + ",".join(f"{a:x}-{b:x}" for a, b in _ranges(known))
            else:
                inside = [ord(c) for c in pattern.findall(NON_ASCII)]
                negated = len(inside) > len(NON_ASCII) // 2
                listed = sorted(set(map(ord, NON_ASCII)) - set(inside)) if negated else inside
                rest = ("+" if negated else "-") + ",".join(f"{a:x}-{b:x}" for a, b in _ranges(listed))
            self._known[key] = f"{mask:032x} {rest}"
        return self.classes.setdefault(self._known[key], len(self.classes))


def _ranges(numbers: list[int]) -> list[tuple[int, int]]:
    out: list[tuple[int, int]] = []
    for n in numbers:
        if out and out[-1][1] == n - 1:
            out[-1] = (out[-1][0], n)
        else:
            out.append((n, n))
    return out


def deck() -> str:
    return tables(
        lark_grammar.build_parser(lark_grammar.grammar_text()), lark_grammar.STARTS, "grammar/*.lark"
    )


def veriloga() -> str:
    text = (HERE / "veriloga.lark").read_text(encoding="utf-8")
    lark = Lark(text, parser="lalr", lexer="contextual", start=["start"], maybe_placeholders=False)
    return tables(lark, ("start",), "grammar/veriloga.lark")


def tables(lark: Lark, starts: tuple[str, ...], source: str) -> str:
    table, lexer = lark.parser.parser._parse_table, lark.parser.lexer
    terminals = sorted(lark.terminals, key=lambda t: t.name)
    patterns = Patterns()
    symbol = {t.name: k for k, t in enumerate(terminals)}
    symbol["$END"] = len(symbol)
    origins = sorted({str(rule.origin.name) for rule in lark.rules})
    symbol.update({name: len(symbol) + k for k, name in enumerate(origins)})
    out = [f"# the tables of {source}, written by grammar/export.py", f"terminals {len(terminals)}"]
    for t in terminals:
        ignored = "i" if t.name in lark.ignore_tokens else "."
        out.append(f"{t.name} {ignored} {patterns.notation(t.pattern.to_regexp())}")
    out.append(f"classes {len(patterns.classes)}")
    out += patterns.classes
    # rules: origin, what the tree is called (`_`: its children go to the parent), the children
    rules = sorted(lark.rules, key=lambda r: (str(r.origin.name), [str(s.name) for s in r.expansion]))
    number = {rule: k for k, rule in enumerate(rules)}
    names: dict[str, int] = {}
    lines = []
    for rule in rules:
        options = rule.options
        name = str(rule.alias or options.template_source or rule.origin.name)
        children = "".join(_child(s, options.keep_all_tokens) for s in rule.expansion) or "-"
        single = "1" if options.expand1 and not rule.alias else "."
        # the name of a nameless rule is never seen
        name = "_" if name.startswith("_") else name
        lines.append(f"{symbol[rule.origin.name]} {names.setdefault(name, len(names))} {single} {children}")
    out += [f"names {len(names)}", *names, f"rules {len(lines)}", *lines]
    # states in the order in which they are met
    order: dict[int, int] = {}
    queue = [table.start_states[start] for start in starts]
    while queue:
        state = queue.pop(0)
        if state in order:
            continue
        order[state] = len(order)
        row = table.states[state]
        queue += [row[s][1] for s in sorted(row) if row[s][0] is Shift]
    lexers: dict[str, int] = {}
    lookaheads: dict[str, int] = {}
    rows = []
    for state in order:
        words = [str(lexers.setdefault(_lexer(lexer.lexers[state], symbol), len(lexers)))]
        reductions: dict[int, list[int]] = {}
        for name in sorted(table.states[state], key=lambda s: symbol[s]):
            action, target = table.states[state][name]
            if action is Shift:
                words.append(f"{symbol[name]}:{order[target]}")
            else:
                reductions.setdefault(number[target], []).append(symbol[name])
        for rule_number, tokens in reductions.items():
            key = " ".join(map(str, tokens))
            words.append(f"{lookaheads.setdefault(key, len(lookaheads))}@{rule_number}")
        rows.append(" ".join(words))
    out += [f"lexers {len(lexers)}", *lexers, f"lookaheads {len(lookaheads)}", *lookaheads]
    out += [f"states {len(rows)}", *rows, f"starts {len(starts)}"]
    out += [f"{s} {order[table.start_states[s]]} {order[table.end_states[s]]}" for s in starts]
    return "\n".join(out) + "\n"


def _child(s, keep_all: bool) -> str:
    """`k` keep, `x` leave out, `i` put the children of a nameless rule in its place."""
    if s.is_term:
        return "k" if keep_all or not s.filter_out else "x"
    return "i" if s.name.startswith("_") else "k"


def _lexer(basic, symbol: dict[str, int]) -> str:
    """The terminals of a lexer in the order in which they are tried; `w>k`: a whole match of w that k matches
    too is a k."""
    wanted, _ = _create_unless(basic.terminals, basic.g_regex_flags, re, False)
    words = [str(symbol[t.name]) for t in wanted]
    for t in basic.terminals:
        if isinstance(t.pattern, PatternRE):
            for keyword in basic.terminals:
                if isinstance(keyword.pattern, PatternStr) and keyword.priority == t.priority:
                    s = keyword.pattern.value
                    if re.fullmatch(t.pattern.to_regexp(), s):
                        words.append(f"{symbol[t.name]}>{symbol[keyword.name]}")
    return " ".join(words)


TARGETS = {
    ENGINE / "syntax" / "src" / "tables.txt": deck,
    ENGINE / "veriloga" / "src" / "tables.txt": veriloga,
}

if __name__ == "__main__":
    for target, made in TARGETS.items():
        text = made()
        if "--check" not in sys.argv:
            target.write_text(text, encoding="utf-8")
        elif not target.exists() or target.read_text(encoding="utf-8") != text:
            sys.exit(f"{target.name} of {target.parent.name}/ is out of date")
