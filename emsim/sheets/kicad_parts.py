"""What a symbol of KiCad's is to SPICE, by its fields: Sim.Device, Sim.Type, Sim.Params, Sim.Pins, Sim.Library, Sim.Name, as
KiCad's manual has them ("Simulator", "Assigning models"), or those of version 6: Spice_Primitive, Spice_Model, Spice_Lib_File,
Spice_Node_Sequence.

A Sim.Device that is the word of a machine's card makes such a card. Without such fields a resistor, capacitor, coil or source of
that reference is one by its value; a connector is nothing.
"""

from __future__ import annotations

import os
import re

from ..cards import CARDS
from ..diagnostics import Span
from . import shipped
from .library import model_of, terminals_of
from .sheet import Pin, word

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from ..source import SourceFile
    from .kicad import Unit
    from .sexpr import Node
    from .sheet import Card, Sheet, Word

# terminals of devices in the order of SPICE
ORDER = {
    "R": "+ -", "C": "+ -", "L": "+ -", "V": "+ -", "I": "+ -", "D": "A K", "NPN": "C B E S", "PNP": "C B E S",
    "NMOS": "D G S B", "PMOS": "D G S B", "NJFET": "D G S", "PJFET": "D G S", "NMES": "D G S", "PMES": "D G S",
    "SW": "no+ no- ctrl+ ctrl-", "E": "out+ out- in+ in-", "G": "out+ out- in+ in-", "TLINE": "1+ 1- 2+ 2-",
}  # fmt: skip
LETTERS = {
    "NPN": "Q", "PNP": "Q", "NMOS": "M", "PMOS": "M", "NJFET": "J", "PJFET": "J", "NMES": "Z", "PMES": "Z", "SW": "S",
    "TLINE": "T", "SUBCKT": "X",
}  # fmt: skip
MODELS = {
    "D": "D",
    "NPN": "NPN",
    "PNP": "PNP",
    "NMOS": "NMOS",
    "PMOS": "PMOS",
    "NJFET": "NJF",
    "PJFET": "PJF",
    "NMES": "NMF",
    "PMES": "PMF",
}
# waveforms of sources and their parameters in the order of SPICE
WAVES = {
    "SIN": "dc ampl f td theta phase", "PULSE": "y1 y2 td tr tf tw per np", "EXP": "y1 y2 td1 tau1 td2 tau2",
    "SFFM": "dc ampl f mdi fs", "AM": "vo mo fm fc td", "TRNOISE": "na ts",
}  # fmt: skip
# devices of types of .model
TYPES = {
    "NPN": "NPN", "PNP": "PNP", "LPNP": "PNP", "D": "D", "NMOS": "NMOS", "PMOS": "PMOS", "VDMOS": "NMOS", "NJF": "NJFET",
    "PJF": "PJFET", "NMF": "NMES", "PMF": "PMES",
}  # fmt: skip
LEVELS = {
    "MOS1": "1",
    "MOS2": "2",
    "MOS3": "3",
    "BSIM3": "8",
    "BSIM4": "14",
    "VBIC": "4",
    "MOS6": "6",
    "MOS9": "9",
}
NOTHING = ("J", "P", "TP", "H", "MH", "FID", "MK", "JP", "LOGO", "X", "CN", "CONN", "G", "SYM", "KIBOT")
VARIABLE = re.compile(r"\$\{(\w+)\}")
MEGA = re.compile(r"^([-+]?[\d.]+)M(?![\w])|^([-+]?[\d.]+)M(?=[HFVA\u03a9\u2126]|Hz|ohm)", re.I)
PAIR = re.compile(r'(\w[\w.+-]*)\s*=\s*("(?:[^"\\]|\\.)*"|[^\s"]+)')


class Lacks(Exception):
    """A symbol that is no card, and what to do."""

    def __init__(
        self, said: str, hint: str = "give it a model in KiCad (Sim.Device), or exclude it from simulation"
    ) -> None:
        super().__init__(said)
        self.hint = hint


class Fields:
    """Of one symbol, by name without regard to case."""

    def __init__(self, file: SourceFile, node: Node, reference: Word) -> None:
        self.file, self.reference = file, reference
        self.of = {str(f.word(1)).lower(): f.word(2) for f in node.all("property")}
        self.value = self.of.get("value", word(""))
        use = node.text("use")
        self.unit = str(use or node.text("unit") or "1")
        enabled = (self.get("Sim.Enable") or self.get("Spice_Netlist_Enabled") or "1").lower()
        self.left_out = node.text("exclude_from_sim") == "yes" or enabled in ("0", "n", "no", "false")

    def get(self, name: str) -> Word:
        found = self.of.get(name.lower(), word(""))
        return word("", found.line) if found == "~" else found


class Parts:
    """Makes the cards of a sheet's parts; libraries are named once."""

    def __init__(self, sink: Sink, own: Sheet) -> None:
        self.sink, self.own = sink, own
        self.libraries: dict[str, Word] = {}
        self.bare: list[Word] = []
        self.folder = os.path.dirname(own.file.path or "")

    def add(self, units: list[Unit]) -> None:
        """The part that these units make. Raises Lacks."""
        fields = units[0].fields
        for unit in units:
            for name, value in unit.fields.of.items():
                fields.of.setdefault(name, value)
        if fields.left_out:
            return
        pins = {number: pin for unit in units for number, pin in unit.pins.items()}
        for number in sorted(
            set().union(*(unit.every for unit in units)) - set(pins)
        ):  # of units that do not stand there
            pins[number] = Pin(0, 0, "", fields.reference)
            pins[number].net = f"NC-{fields.reference}-{number}"
        device = fields.get("Sim.Device").upper()
        if fields.get("Spice_Primitive"):
            name, cards = self._old(fields, pins)
        elif device or fields.get("Sim.Library"):
            name, cards = self._new(fields, device, pins)
        else:
            name, cards = self._by_value(fields, pins)
        if not cards:
            return
        units[0].symbol.cards = cards
        for unit in units:
            unit.symbol.name = name.lower()

    def finish(self) -> None:
        for path, at in reversed(self.libraries.items()):
            found = None if os.path.isfile(os.path.join(self.folder, path)) else shipped.cards(path)
            self.own.cards[:0] = found or [[".include", word(f'"{path}"', at.line, at.col)]]
        if self.bare:
            span = Span(
                self.own.file,
                max(1, self.bare[0].line),
                self.bare[0].col,
                self.bare[0].col + len(self.bare[0]),
            )
            names = ", ".join(self.bare[:10]) + (", .." if len(self.bare) > 10 else "")
            self.sink.warning(
                "W155", f"left out, without a model: {names}", span, "nothing flows into their pins"
            )

    # ---- by fields ----

    def _by_value(self, fields: Fields, pins: dict[str, Pin]) -> tuple[str, list[Card]]:
        """A resistor, capacitor, coil or source that has a value alone."""
        reference = fields.reference
        prefix = re.match(r"[A-Za-z]*", reference)
        letters = prefix[0].upper() if prefix else ""
        if letters in NOTHING:
            self.bare.append(reference)
            return "", []
        value = fields.value
        letters = letters[:1] if len(pins) == 2 else letters
        if letters in ("R", "C", "L", "V", "I") and len(pins) == 2 and value not in ("", "~", letters):
            plain = _number(value, letters in ("R", "C", "L"))
            return reference, [[reference, *_in_order(pins), plain]]
        raise Lacks(f"{reference} (`{value}`) has no simulation model")

    def _old(self, fields: Fields, pins: dict[str, Pin]) -> tuple[str, list[Card]]:
        """By the fields of version 6."""
        primitive, model = fields.get("Spice_Primitive"), fields.get("Spice_Model") or fields.value
        order = _in_order(pins)
        sequence = re.split(r"[\s,]+", fields.get("Spice_Node_Sequence").strip())
        if sequence != [""]:
            if not all(n.isdigit() and 0 < int(n) <= len(order) for n in sequence):
                raise Lacks(
                    f"{fields.reference}: Spice_Node_Sequence `{' '.join(sequence)}` names pins that are not there"
                )
            order = [order[int(n) - 1] for n in sequence]
        self._library(fields.get("Spice_Lib_File"))
        name = _named(fields.reference, primitive)
        return name, [[name, *order, _raw(model)]]

    def _new(self, fields: Fields, device: str, pins: dict[str, Pin]) -> tuple[str, list[Card]]:
        """By the fields of versions 7 to 9."""
        params = fields.get("Sim.Params")
        pairs = {key.lower(): _unquoted(value) for key, value in PAIR.findall(params)}
        given = self._assigned(fields, pins)
        path = self._library(fields.get("Sim.Library"))
        if device == "SPICE":
            kind = pairs.get("type", "X")
            if pairs.get("lib"):
                self._library(word(pairs["lib"], params.line, params.col))
            name = _named(fields.reference, kind)
            order = [given[n] for n in sorted(given, key=_by_number)] or _in_order(pins)
            return name, [[name, *order, _raw(word(pairs.get("model", ""), params.line, params.col))]]
        if device in CARDS:
            return str(fields.reference), [[device, fields.reference, *_in_order(pins), params]]
        model = fields.get("Sim.Name")
        of = model_of(path, model or fields.value) if path and device in ("", "SUBCKT") else ""
        device = TYPES.get(of, device or "SUBCKT")
        if device == "SUBCKT" or (device not in ORDER and path):
            return self._subcircuit(fields, pins, given, path, model, params)
        if device not in ORDER:
            raise Lacks(f"{fields.reference}: Sim.Device `{device}` has no card here")
        if device in "RCLVI" and not fields.get("Sim.Pins"):
            given = dict(zip(("+", "-"), _in_order(pins), strict=False))
        order = self._terminals(fields, device, given, of)
        name = _named(fields.reference, LETTERS.get(device, device[:1]))
        kind = fields.get("Sim.Type").upper()
        if device in ("V", "I"):
            return name, [[name, *order, *self._source(fields, kind, pairs, params)]]
        if device in "RCL":
            if kind not in ("", "="):
                raise Lacks(f"{fields.reference}: Sim.Type `{kind}` of {device} has no card here")
            value = pairs.get(device.lower(), "") or fields.value
            return name, [[name, *order, _number(word(value, fields.value.line, fields.value.col), True)]]
        if device in ("E", "G"):
            return name, [[name, *order, word(pairs.get("gain", "1"), params.line, params.col)]]
        if device == "TLINE":
            said = [f"{k}={_number(word(pairs[k]), True)}" for k in ("z0", "td") if k in pairs]
            return name, [[name, *order, *said]]
        if path and (model or of):
            model = model or fields.value
            return name, [[name, *order, model]]
        return name, [[name, *order, f"__{name}"], self._model(name, device, kind, pairs, fields)]

    def _terminals(self, fields: Fields, device: str, given: dict[str, Pin], of: str) -> list[Pin]:
        """In the order of SPICE, `of` a model's type; a bulk that is nobody's is on the source, a substrate is left out."""
        names = ORDER[device].split()
        low = {key.lower(): pin for key, pin in given.items()}
        order = [low.get(name.lower()) or low.get(str(k)) for k, name in enumerate(names, 1)]
        if device in ("NMOS", "PMOS") and order[3] is None:
            order = order[:3] if "VDMOS" in (fields.get("Sim.Type").upper(), of) else [*order[:3], order[2]]
        if device in ("NPN", "PNP") and order[3] is None:
            order = order[:3]
        if None in order:
            missing = ", ".join(n for n, pin in zip(names, order, strict=False) if pin is None)
            raise Lacks(
                f"{fields.reference}: no pin is the terminal {missing} of {device}",
                "its field Sim.Pins says which is",
            )
        return [pin for pin in order if pin is not None]

    def _assigned(self, fields: Fields, pins: dict[str, Pin]) -> dict[str, Pin]:
        """Pins by the terminals that Sim.Pins says they are."""
        found: dict[str, Pin] = {}
        for pair in fields.get("Sim.Pins").split():
            number, _, terminal = pair.partition("=")
            if number not in pins:
                raise Lacks(
                    f"{fields.reference}: Sim.Pins names a pin `{number}` that the symbol does not have"
                )
            found[terminal] = pins[number]
        return found

    def _subcircuit(
        self,
        fields: Fields,
        pins: dict[str, Pin],
        given: dict[str, Pin],
        path: str,
        model: Word,
        params: Word,
    ) -> tuple[str, list[Card]]:
        name = _named(fields.reference, "X")
        of = model or fields.value
        terminals = terminals_of(path, of) if path else None
        low = {key.lower(): pin for key, pin in given.items()}
        if terminals is None:
            order = [given[n] for n in sorted(given, key=_by_number)] if given else _in_order(pins)
        else:
            # by name, or by its number in the row of terminals
            ordered = [low.get(t.lower()) or low.get(str(k)) for k, t in enumerate(terminals, 1)]
            if None in ordered and not given and len(terminals) == len(pins):
                ordered = [*_in_order(pins)]
            if None in ordered:
                missing = ", ".join(t for t, pin in zip(terminals, ordered, strict=True) if pin is None)
                raise Lacks(
                    f"{fields.reference}: no pin is the terminal {missing} of {of}",
                    "its field Sim.Pins says which is",
                )
            order = [pin for pin in ordered if pin is not None]
        said = [
            word(f"{k}={_number(word(_unquoted(v)), True)}", params.line, params.col)
            for k, v in PAIR.findall(params)
        ]
        return name, [[name, *order, of, *said]]

    def _source(self, fields: Fields, kind: str, pairs: dict[str, str], params: Word) -> list[Word]:
        """What follows the nodes of a source."""

        def at(text: str) -> Word:
            return word(text, params.line or fields.value.line, params.col)

        def number(key: str) -> str:
            return _number(word(pairs.get(key, "0")), True)

        small = f"AC {number('ac')}" + (f" {number('ph')}" if "ph" in pairs else "") if "ac" in pairs else ""
        if kind in ("", "DC"):
            dc = number("dc") if "dc" in pairs else "" if pairs else _number(fields.value, True)
            return [at(f"DC {dc}" if dc else "DC 0"), at(small)]
        if kind == "PWL":
            return [at(f"PWL({pairs.get('pwl', '')})"), at(small)]
        if kind == "=":
            raise Lacks(f"{fields.reference}: Sim.Type `=` needs its expression in Sim.Params")
        if kind not in WAVES:
            raise Lacks(f"{fields.reference}: a source of Sim.Type `{kind}` has no card here")
        names = WAVES[kind].split()
        last = max((k for k, n in enumerate(names) if n in pairs), default=-1)
        return [at(f"{kind}({' '.join(number(n) for n in names[: last + 1])})"), at(small)]

    def _model(self, name: str, device: str, kind: str, pairs: dict[str, str], fields: Fields) -> Card:
        """The card of a model whose parameters stand in the symbol."""
        place = fields.get("Sim.Params")
        said = [f"{k}={_number(word(v), True)}" for k, v in pairs.items() if k not in ("type",)]
        if device == "SW":
            names = {"thr": "vt", "his": "vh", "ron": "ron", "roff": "roff"}
            said = [f"{names[k]}={_number(word(v), True)}" for k, v in pairs.items() if k in names]
            return [f".model __{name} SW(", word(" ".join(said), place.line, place.col), ")"]
        if kind == "VDMOS":
            return [
                f".model __{name} VDMOS",
                "NCHAN" if device == "NMOS" else "PCHAN",
                word(" ".join(said), place.line, place.col),
            ]
        level = [f"level={LEVELS[kind]}"] if kind in LEVELS and kind != "MOS1" else []
        return [f".model __{name} {MODELS[device]}", *level, word(" ".join(said), place.line, place.col)]

    # ---- libraries ----

    def _library(self, given: Word) -> str:
        """Notes a library; its path, as far as this side knows it."""
        if not given:
            return ""
        path = VARIABLE.sub(
            lambda m: (self.folder or ".") if m[1] == "KIPRJMOD" else os.environ.get(m[1], ""), given
        )
        found = os.path.join(self.folder, path)
        if not os.path.isfile(found):
            beside = re.split(r"[\\/]", path)[-1]
            if shipped.cards(path) is not None:
                found = os.path.join(shipped.FOLDER, beside)
            elif os.path.isfile(os.path.join(self.folder, beside)):
                span = Span(self.own.file, max(1, given.line), given.col, given.col + len(given))
                said = f"{given} is not there: {beside} beside the schematic is taken in its place"
                self.sink.warning("W155", said, span, "its folder is that of another machine")
                path, found = beside, os.path.join(self.folder, beside)
        self.libraries.setdefault(path, given)
        return found


def _named(reference: Word, letter: str) -> Word:
    text = str(reference)
    if text[:1].upper() != letter[:1].upper():
        text = letter[:1] + text
    return word(text, reference.line, reference.col)


def _unquoted(value: str) -> str:
    return re.sub(r"\\(.)", r"\1", value[1:-1]) if value[:1] == '"' else value


def _by_number(name: str) -> tuple[int, str]:
    return (int(name) if name.isdigit() else 1 << 30, name)


def _in_order(pins: dict[str, Pin]) -> list[Pin]:
    """By their numbers."""
    return [pins[n] for n in sorted(pins, key=_by_number)]


def _number(given: Word, mega: bool) -> Word:
    """A value as KiCad reads it, in SPICE's letters: M is mega, 4k7 is 4.7k."""
    text = (
        given.replace("\u00b5", "u")
        .replace("\u03bc", "u")
        .replace("\u2126", "")
        .replace("\u03a9", "")
        .strip()
    )
    text = re.sub(
        r"^(\d+)(meg|[tgkmunpfr])(\d+)$",
        lambda m: f"{m[1]}.{m[3]}{'' if m[2] in 'rR' else m[2]}",
        text,
        flags=re.I,
    )
    if mega:
        text = re.sub(r"^([-+]?[\d.]+)\s*M(?=$|[HFVA]$|Hz$|[Oo]hm$)", r"\1Meg", text)
    text = re.sub(r"^([-+]?[\d.]+) +([a-zA-Z]+)$", r"\1\2", text)
    return word(text, given.line, given.col)


def _raw(model: Word) -> Word:
    """A card's rest as it stands; dc(1) is dc 1."""
    return word(re.sub(r"\b(dc|ac)\s*\(([^()]*)\)", r"\1 \2", model, flags=re.I), model.line, model.col)
