"""The language reference of the site, written from the tables and specs that the program itself reads."""

from __future__ import annotations

import inspect
import sys
from importlib import import_module

from emsim import units
from emsim.cards import CARDS
from emsim.cards.base import PROBES as CARD_PROBES
from emsim.cards.base import Card, Param
from emsim.cards.joints import ALIASES, KINDS
from emsim.cards.motors import MODELS as MOTORS
from emsim.cli import VERBS
from emsim.cli.explain import message
from emsim.cli.help import EXIT_CODES, verb_help
from emsim.editor import words
from emsim.elements import LETTERS, Element
from emsim.elements import Param as Word
from emsim.reports.codes import catalogue
from emsim.reports.words import BRINGS, default, meaning

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence


def pages() -> dict[str, str]:
    """Address in the site -> Markdown."""
    return {
        "reference/cards.md": cards(),
        "reference/elements.md": all_elements(),
        "reference/dots.md": dots(),
        "reference/options.md": options(),
        "reference/functions.md": functions(),
        "reference/waveforms.md": waveforms(),
        "reference/code_models.md": code_models(),
        "reference/probes.md": probes(),
        "reference/numbers.md": numbers(),
        "reference/commands.md": commands(),
        "reference/messages.md": messages(),
    }


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Markdown; bars in cells are escaped, for they would end the cell."""
    lines = [head, ["---"] * len(head), *rows]
    return (
        "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
        + "\n"
    )


def code(text: str) -> str:
    return f"`{text}`" if text else ""


# ---- machine cards ------------------------------------------------------------------------------


def cards() -> str:
    names = table(
        ["card", "what it is"],
        ([f"[{word}](#{word.lower()})", card.spec.meaning] for word, card in CARDS.items()),
    )
    text = (
        "# Machine cards\n\nA line is a machine card where its first word is the card word and the line carries the card's mark; "
        "otherwise it is SPICE, as ever. Values are SI, see [numbers and units](numbers.md).\n\n"
        f"{names}\n"
    )
    motors = [one_card(machine, kind) for kind, machine in MOTORS.items() if machine is not CARDS["MOTOR"]]
    return text + "\n".join([*(one_card(card) for card in CARDS.values()), *motors])


def one_card(card: type[Card], kind: str = "") -> str:
    """Form, mark, terminals, parameters, and the derivation that stands at the head of the card's file."""
    spec = card.spec
    parts = [
        f"## {spec.word} {kind}".rstrip() + (f" {{ #{kind} }}\n" if kind else "\n"),
        spec.meaning[0].upper() + spec.meaning[1:] + ".\n",
    ]
    parts.append(f"```spice\n{spec.form}\n```\n")
    marks = {"POINT": "the dot in its name", "JOINT": "the kind, its fourth word"}
    mark = marks.get(spec.word) or " or ".join(f"`{word}=`" for word in spec.mark)
    forms = " or ".join(" ".join(f"`{name}` ({kind})" for name, kind in form) for form in spec.forms if form)
    parts.append(f"Mark: {mark}." + (f" Terminals: {forms}." if forms else "") + "\n")
    if spec.params:
        rows = [
            [code(key), param.unit, default(param), meaning(param) + varies(param)]
            for key, param in spec.params.items()
        ]
        parts.append(table(["parameter", "unit", "default", "meaning"], rows))
    if spec.word == "JOINT":
        parts.append(kinds())
    if spec.word == "MOTOR" and card is CARDS["MOTOR"]:
        names = (
            [f"[{code(kind)}](#{kind})", machine.spec.meaning]
            for kind, machine in MOTORS.items()
            if machine is not card
        )
        parts.append(
            "\nOther machines, by the type of their .model:\n\n" + table(["type", "what it is"], names)
        )
    if spec.laws:
        parts.append(table(["brings", ""], ([BRINGS[kind], code(law)] for kind, law in spec.laws.items())))
    module = sys.modules[card.__module__]
    parts.append("**How it works**, from the head of its file:\n")
    parts.append("```text\n" + (inspect.getdoc(module) or "") + "\n```\n")
    return "\n".join(parts)


def varies(param: Param) -> str:
    return "; a number, an expression in braces, or a waveform" if param.kind == "value" else ""


def kinds() -> str:
    """Kinds of joints and what they let move."""
    twins = {kind: alias for alias, kind in ALIASES.items()}
    rows = [
        [
            code(name) + (f" = {code(twins[name])}" if name in twins else ""),
            str(len(kind.speeds)) if kind.in_tree else "",
            kind.meaning,
        ]
        for name, kind in KINDS.items()
    ]
    return "\n" + table(["kind", "degrees of freedom", "lets B move against A"], rows)


# ---- the circuit --------------------------------------------------------------------------------


def all_elements() -> str:
    rows = [
        [f"[{kind.letter.upper()}](#{kind.letter})", kind.what, code(kind.form)] for kind in LETTERS.values()
    ]
    parts = [
        "# Elements\n",
        "What a line is follows from its first letter, as in SPICE. The current of an element counts as positive into its first "
        "terminal; `i(name)` reads it.\n",
        table(["letter", "what it is", "form"], rows),
    ]
    parts += [one_element(kind) for kind in LETTERS.values()]
    return "\n".join(parts)


def one_element(kind: type[Element]) -> str:
    parts = [
        f"\n## {kind.letter.upper()}, {kind.what} {{ #{kind.letter} }}\n\n```spice\n{kind.form}\n```\n",
        f"Law: {code(kind.law)}.\n",
        parameters("parameter on the line", kind.instance),
    ]
    if kind.model_types:
        parts.append(f"Model types: {' '.join(map(code, kind.model_types))}.\n")
        rows = [
            [" ".join(map(code, names)), unit, "-" if value != value else f"{value:g}", meaning]
            for names, unit, value, meaning in kind.model_table()
        ]
        parts.append(
            table([f"parameter of `.model .. {kind.model_types[0]}`", "unit", "default", "meaning"], rows)
        )
        parts.append(accepted(kind.model_words))
    return "\n".join(parts)


def parameters(head: str, words: dict[str, Word]) -> str:
    """A table of those that mean something; the others are accepted as ngspice has them."""
    rows = [
        [code(name), p.unit, "-" if p.default is None else f"{p.default:g}", p.meaning]
        for name, p in words.items()
        if p.meaning
    ]
    return (table([head, "unit", "default", "meaning"], rows) if rows else "") + accepted(words)


def accepted(words: Mapping[str, Word]) -> str:
    rest = [code(name) for name, p in words.items() if not p.meaning]
    return f"\nAccepted as in ngspice: {' '.join(rest)}.\n" if rest else ""


def dots() -> str:
    rows = [[code(word), code(form), meaning] for word, (form, meaning) in words.DOTS.items()]
    return "# Dot cards\n\n" + table(["card", "form", "meaning"], rows)


def options() -> str:
    rows = [[code(name), unit, value, meaning] for name, (unit, value, meaning) in words.OPTIONS.items()]
    return (
        "# Options\n\n`.options name=value ..` in the deck; `--method`, `--reltol`, `--tmax` on the command line win over it. "
        "`emsim check deck.cir` prints the tolerances that a deck gets, with unit and where each comes from. "
        "\n\n"
        + table(["option", "unit", "default", "meaning"], rows)
        + "\nOptions of ngspice about its own printing and matrix code are accepted in silence; an option that nobody knows "
        "is named in a note, with the nearest one that exists.\n"
    )


def functions() -> str:
    rows = [[code(form), meaning] for form, meaning in words.FUNCTIONS.values()]
    surprises = (inspect.getdoc(import_module("emsim.assemble.behaviour")) or "").partition("\n\n")[2]
    return (
        "# Functions of expressions\n\nIn braces on any card, in B sources, in `.print`: `{expression}`. Operators: "
        "`+ - * / % ^ **`, `< > <= >= == != && || !`, `c ? a : b`. Names: parameters, `time` [s], `temper` [C], `pi`, `e`. "
        "What reads nodes and the machine: [probes](probes.md).\n\n"
        + table(["function", "value"], rows)
        + f"\n## Where ngspice's meaning surprises\n\n{surprises}\n"
    )


def code_models() -> str:
    """Of A lines."""
    from emsim.elements.xspice import NAMES, code_model

    kinds = [code_model(name) for name in sorted(NAMES)]
    names = table(
        ["code model", "what it is"], ([f"[{kind.name}](#{kind.name})", kind.what] for kind in kinds)
    )
    parts = [
        "# Code models\n\nAn A line puts one of XSPICE's code models into a circuit; the word of its `.model` says which. "
        "Connections stand in the order of the form: lists in `[ ]`, `%vd(a b)` where a connection is of another type, "
        "`~` before "
        "a digital one turns it round, `null` leaves one open. More of them: [digital circuits](../guide/digital.md).\n\n"
        + names
    ]
    for kind in kinds:
        rows = [[code(key), w.unit, w.told(), w.meaning] for key, w in kind.parameters.items() if w.meaning]
        ends = [
            [code(p.name), " ".join(code("%" + t) for t in p.types), "may be `null`" if p.is_open else ""]
            for p in kind.ports
        ]
        parts.append(
            f"\n## {kind.name}\n\n{kind.what[0].upper() + kind.what[1:]}.\n\n```spice\n{kind.form()}\n```\n"
        )
        parts += [f"{code(kind.law)}\n"] if kind.law else []
        parts.append(table(["connection", "may be", ""], ends))
        parts += (
            ["\n" + table([f"parameter of `.model .. {kind.name}`", "unit", "default", "meaning"], rows)]
            if rows
            else []
        )
        parts.append(accepted(kind.parameters))
    return "\n".join(parts)


def waveforms() -> str:
    """Of V and I, and of FORCE, TORQUE, DRIVE (in N, N m, rad or m there)."""
    parts = [
        "# Waveforms\n\nOn V and I, and wherever a machine card takes a value that changes (`FORCE`, `TORQUE`, `DRIVE`; the "
        "values are then N, N m, rad or m). `tstep` and `tstop` are those of `.tran`. Where the default is marked *or 0*, "
        "a written 0 counts as left out, as in ngspice. Corners of PULSE and PWL are stepped onto exactly.\n"
    ]
    for word, (what, _) in words.WAVES.items():
        cells = [[code(name), unit, value] for name, unit, value in words.arguments(word)]
        parts.append(f"## {word}\n\n{what[0].upper()}{what[1:]}.\n\n```spice\n{words.wave_form(word)}\n```\n")
        parts.append(table(["argument", "unit", "if left out"], cells))
    return "\n".join(parts)


# ---- machine and numbers ------------------------------------------------------------------------


def probes() -> str:
    rows = [[code(form), unit, meaning] for form, unit, meaning in words.PROBES.values()]
    return (
        "# Reading circuit and machine\n\nIn expressions, `.print`, `.save`, `.probe` and as columns of a result. A name is a "
        "function of the machine only where its argument names something mechanical: `x(arm.tip)` is a place, a node called `x` "
        "is not disturbed. Points are `body`, `body(x,y)`, `body.com` or a POINT's name; reactions act on B from A, in world "
        f"axes. What a card offers: {' '.join(code(p + '(card)') for p in CARD_PROBES)}.\n\n"
        + table(["call", "unit", "meaning"], rows)
    )


def numbers() -> str:
    scales = [
        [code(letter), f"{factor:g}", units._SCALE_NAMES[letter]]
        for letter, factor in units.SCALES.items()
        if letter.isascii()
    ]
    scales += [
        [code(word), f"{factor:g}", units._SCALE_NAMES[word]] for word, factor in units._LONG_SCALES.items()
    ]
    known = [[code(word), f"{factor:g}"] for word, factor in units.UNITS.items()]
    rest = (inspect.getdoc(units) or "").partition("\n\n")[2]
    return (
        f"# Numbers and units\n\n{rest}\n\n## Scale suffixes\n\nOf any case: `M` is milli, `meg` is mega.\n\n"
        + table(["suffix", "factor", "name"], scales)
        + "\n## Units on machine cards\n\n"
        + table(["unit", "in SI"], known)
        + "\n`5N` on a machine card is questioned (5 nano, not 5 newton), `5foo` is refused.\n"
    )


def commands() -> str:
    parts = [
        "# Commands\n\n"
        + table(["verb", "what it does"], ([f"[{v}](#{v})", text] for v, text in VERBS.items()))
    ]
    parts += [f"\n## {verb}\n\n```text\n{verb_help(verb)}\n```\n" for verb in VERBS]
    return "\n".join(parts) + f"\n## Exit codes\n\n```text\n{EXIT_CODES}\n```\n"


def messages() -> str:
    """The catalogue of codes; what each deck is told comes from running it."""
    known = catalogue()
    families = dict.fromkeys(entry.family for entry in known.values())
    parts = [
        "# Messages\n\nEvery code with what it means, a deck that gives it, what emsim says of that deck, and the deck mended. "
        "`emsim explain CODE` prints the same.\n"
    ]
    for family in families:
        mine = [entry for entry in known.values() if entry.family == family]
        parts.append(f"## {family}\n")
        parts.append(table(["code", "title"], ([f"[{e.code}](#{anchor(e.code)})", e.title] for e in mine)))
        for entry in mine:
            parts.append(f"### {entry.code} {entry.title} {{ #{anchor(entry.code)} }}\n\n{entry.meaning}\n")
            parts += [block("spice", text, name) for name, text in entry.example.items()]
            if entry.command:
                parts.append(block("text", f"$ {entry.command}\n{message(entry)}"))
            parts.append(entry.remedy + "\n")
            parts += [block("spice", text, f"{name}, mended") for name, text in entry.fixed.items()]
    return "\n".join(parts)


def anchor(code: str) -> str:
    return code.lower().replace(" ", "-")


def block(language: str, text: str, title: str = "") -> str:
    head = f' title="{title}"' if title else ""
    return f"```{language}{head}\n{text.rstrip()}\n```\n"
