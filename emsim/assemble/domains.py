"""Nodes of heat, magnetic and hydraulic circuits, and whose heat goes where: what cards of these domains share."""

from __future__ import annotations

from ..cards.domains import DOMAINS, level
from ..diagnostics import instead, suggest
from ..elements.accounts import DISSIPATED, Accounts
from ..elements.base import ZERO_CELSIUS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..cards.base import Card
    from ..diagnostics import Span
    from .binding import Binding

GROUND = ("0", "gnd")
CAPACITIES = {
    "heat": ", or give it c=",
    "hydraulic": ", or give it a vol= with bulk=",
}  # what says it besides


class Domains:
    """nodes    domain -> name -> unknown, each made at its first mention
    places   name -> first place in the deck, of all domains
    warms    owner -> card into whose node its heat goes
    """

    def __init__(self, m: Binding) -> None:
        self.m: Any = m  # once it is built, a Mechanism
        self.nodes: dict[str, dict[str, int]] = {key: {} for key in DOMAINS}
        self.places: dict[str, tuple[str, Span]] = {}
        self.warms: dict[str, Card] = {}

    @property
    def surroundings(self) -> float:
        """Temperature of the surroundings [K]."""
        return float(self.m.ctx.temp) + ZERO_CELSIUS

    @property
    def nominal(self) -> float:
        """Temperature that numbers of models are for [K]."""
        return float(self.m.ctx.tnom) + ZERO_CELSIUS

    def named(self, domain: str, name: str, where: Span) -> int:
        """The unknown of a node; -1 for ground."""
        if name in GROUND:
            return -1
        found = self.nodes[domain].get(name)
        if found is not None:
            return found
        unit, before = DOMAINS[domain].unit, self.places.get(name)
        if before is not None or name in self.m.ctx.nodes:
            other = "the electrical circuit" if before is None else f"the {before[0]} domain"
            said = f"`{name}` is a node of {other} already; a {DOMAINS[domain].card} has nodes of its own"
            self.m.sink.error(
                "E260", said, where, "take another name: what couples domains is a card of both"
            )
            self.m.broken = True
        else:
            self.places[name] = (domain, where)
        row = self.m.b.unknown(f"{DOMAINS[domain].across}({name})", "node", unit, 0.0)
        self.nodes[domain][name] = row
        return row

    def read(self, domain: str, name: str, span: Span | None) -> Expr:
        """The across quantity of a node by its name."""
        row = -1 if name in GROUND else self.nodes[domain].get(name)
        if row is None:
            near = suggest(name, self.nodes[domain])
            known = ", ".join(self.nodes[domain]) or "none"
            said = f"no node of the {domain} domain is named {name}"
            self.m.sink.error("E250", said, span, f"did you mean {near}?" if near else f"there are: {known}",
                              fixes=instead(span, name, near) if near else [])  # fmt: skip
            return self.m.b.const(0.0)
        return level(self.m, DOMAINS[domain], row)

    # ---- heat of others ----

    def warm(self, owner: str, card: Card, where: Span) -> None:
        """From now on what `owner` turns into heat goes where `card` says, and is no loss."""
        m = self.m
        if owner in self.warms:
            said = f"the heat of {owner} goes into a node already, by {self.warms[owner].spec.word} {self.warms[owner].name}"
            m.sink.error("E261", said, where, "one node for all of it; HEAT r= leads it on")
        elif (owner in m.couplings or owner in m.joints) and owner in m.ctx.elements:
            said = f"{owner} is an element and a mechanical thing: whose heat is meant?"
            m.sink.error("E261", said, where, "give one of them another name")
        elif owner not in m.couplings and owner not in m.joints and owner not in m.ctx.elements:
            near = suggest(owner, [*m.ctx.elements, *m.couplings, *m.joints])
            said = f"nothing that could turn anything into heat is named {owner}"
            m.sink.error("E250", said, where, f"did you mean {near}?" if near else None)
        elif owner in m.ctx.elements and self._of_element(owner) is None:
            said = f"the heat of {owner} is not one power that could be led into a node"
            hint = "R, and cards with losses, can be led so; a diode or VDMOS has `thermal`, with nodes of its own"
            m.sink.error("E261", said, where, hint)
        else:
            self.warms[owner] = card
            return
        m.broken = True

    def _of_element(self, name: str) -> Expr | None:
        """What a resistor turns into heat [W]; None of what keeps other accounts."""
        e = self.m.ctx.elements[name]
        if e.letter != "r":
            return None
        book = Accounts()
        e.account(self.m.ctx, book)
        return sum((entry.expr for entry in book.entries), self.m.b.const(0.0))

    def heat_of(self, owner: str) -> Expr:
        """What an element, a card or a joint turns into heat [W]."""
        m = self.m
        if owner in m.ctx.elements:
            found: Any = self._of_element(owner)
        else:
            found = (m.couplings[owner] if owner in m.couplings else m.joints[owner].card).losses(m)
        return m.b.const(0.0) + (0.0 if found is None else found)

    def led_away(self, book: Accounts) -> None:
        """Takes out of the book what has gone into nodes of heat."""
        book.entries = [
            e for e in book.entries if not (e.kind == DISSIPATED and e.power and e.name in self.warms)
        ]

    # ---- what is determined ----

    def check(self) -> None:
        """Parts that nothing ties to their ground: a capacity says where they are, or nothing does."""
        m = self.m
        elements = [(c, c.joins(m)) for c in m.couplings.values() if hasattr(c, "joins")]
        for name in (*m.ctx.nodes, *m.ctx.digital):
            if name in self.places:
                domain, span = self.places[name]
                said = f"`{name}` is a node of the {domain} domain and of the electrical circuit"
                m.sink.error("E260", said, span, "take another name: what couples domains is a card of both")
        self._needs_point([c for c, _ in elements])
        parent: dict[int, int] = {}

        def root(x: int) -> int:
            while parent.setdefault(x, x) != x:
                x = parent[x]
            return x

        for _, joins in elements:
            for a, b in joins:
                one, other = root(a), root(b)
                parent[max(one, other)] = min(one, other)  # ground, -1, stays a root
        begins = self._start([c for c, _ in elements])
        known: set[int] = set()
        for row, value in begins.items():
            part = root(row)
            if part != -1 and part not in known:
                known.add(part)
                self._hold(row, value)
        for domain, nodes in self.nodes.items():
            for name, row in nodes.items():
                part = root(row)
                if part == -1 or part in known:
                    continue
                known.add(part)
                word = DOMAINS[domain]
                said = f"nothing says what {word.across}({name}) is: no way leads from `{name}` to 0, {word.ground}"
                m.sink.error(
                    "E262",
                    said,
                    self.places[name][1],
                    f"end a {word.card} branch at node 0" + CAPACITIES.get(domain, ""),
                )
                m.broken = True

    def _hold(self, row: int, value: float) -> None:
        """At rest nothing leads to or from this part: operating points take it as it begins."""
        b, ctx = self.m.b, self.m.ctx
        at_rest = ctx.standstill() * (1.0 - ctx.small_signals())
        b.add_f(row, 1e9 * at_rest * (b.x(row) - value))  # beside which no flow moves it
        if any(run.kind != "tran" for run in ctx.flat.analyses):
            name, domain = next(
                (n, d) for d, nodes in self.nodes.items() for n, r in nodes.items() if r == row
            )
            word = DOMAINS[domain]
            said = f"at rest nothing leads to or from `{name}`: operating points take {word.across}({name}) as it begins"
            self.m.sink.note("N234", said, self.places[name][1], "a run says how it changes")

    def _needs_point(self, cards: list[Any]) -> None:
        """Windings begin with the flux that an operating point finds; under UIC with none, whatever magnets there are."""
        windings = any(c.spec.word == "MAGNETIC" and c.form == "turns" for c in cards)
        magnet = next((c for c in cards if getattr(c, "magnetises", False)), None)
        if magnet is None or not windings:
            return
        for run in self.m.ctx.flat.analyses:
            if run.kind == "tran" and "uic" in run.flags:
                said = f"no operating point is looked for, so the flux that {magnet.spec.word} {magnet.name} drives is not known"
                self.m.sink.error(
                    "E263", said, run.span, "leave out uic", labels=[(magnet.span, "magnetises")]
                )
                self.m.broken = True

    def _start(self, cards: list[Any]) -> dict[int, float]:
        """Where runs begin: by node what the first card says that holds it there, else 0."""
        found: dict[int, float | None] = {}
        for card in cards:
            row, value = card.starts(self.m) or (-1, None)
            if value is not None and found.get(row) is not None:
                said = f"{card.spec.word} {card.name} says where its node starts, and another card of that node does so too"
                self.m.sink.error("E257", said, card.place("ic"), "leave one ic= out")
            if row >= 0 and found.get(row) is None:
                found[row] = value
        begins = {row: value or 0.0 for row, value in found.items()}
        for row, value in begins.items():
            self.m.b.set_initial(row, value)
            self.m.b.force(row, value, "ic")
        return begins

    def outputs(self) -> list[str]:
        """What is recorded when nothing is asked for."""
        return [f"{DOMAINS[key].across}({name})" for key, nodes in self.nodes.items() for name in nodes]
