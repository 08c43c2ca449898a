"""Facts of a deck for `emsim check`: what the equations are made of, before anything is solved."""

from __future__ import annotations

from . import refused, transients

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..assemble import Assembly
    from . import Analysis


def facts(assembly: Assembly, planned: list[Analysis]) -> dict[str, Any]:
    """Plain data:

    title        the deck's
    elements     {letter: count}; machine cards as {word: count} in `cards`
    size         number of unknowns; `unknowns` {kind: count}; `names` of all; `algebraic` rows without d/dt
    nonzeros     of the common pattern of C and G; `linear` when both are constant
    operations   of Q and F, and of these with their derivatives
    events       number of conditions watched
    analyses     as text; `method`, `reltol`
    tolerances   absolute ones, of the kinds of quantity that the deck has: {quantity, unit, option, value, source}
    two_paces    circuit and machine want a pace each, `method=multirate`: a guess from the machine's size and the edges
    formulations {formulation: {size, rows, nonzeros, values, with_derivatives}} of the same machine in joint and
                 in absolute coordinates, or what hinders one of them as text; empty without a machine
    machine      the machine's own report (degrees_of_freedom, loops, folded_rows, ...), or None
    diagnostics  everything said so far
    """
    system, flat = assembly.system, assembly.flat
    unknowns: dict[str, int] = {}
    for kind in system.kinds:
        unknowns[kind] = unknowns.get(kind, 0) + 1
    elements: dict[str, int] = {}
    for e in flat.elements:
        elements[e.letter.upper()] = elements.get(e.letter.upper(), 0) + 1
    cards: dict[str, int] = {}
    for card in flat.machine:
        cards[card.kind] = cards.get(card.kind, 0) + 1
    values, derivatives = system.operations
    report = assembly.machine.report() if assembly.machine is not None else None
    return {
        "title": flat.title,
        "elements": elements,
        "cards": cards,
        "size": system.n,
        "unknowns": unknowns,
        "names": system.names,
        "algebraic": sum(not d for d in system.differential_rows),
        "nonzeros": len(system.pattern()[1]),
        "linear": system.linear,
        "operations": {"values": values, "with_derivatives": derivatives},
        "events": len(system.flag_names),
        "analyses": [a.text() for a in planned],
        "method": assembly.options["method"],
        "reltol": assembly.options.get("reltol", 1e-3),
        "tolerances": _tolerances(assembly),
        "two_paces": any(system.two_paces(t.tstop) for t in transients(planned)),
        "formulations": _formulations(assembly) if report else {},
        "machine": report,
        "diagnostics": [*flat.sink.diagnostics, *refused(flat)],
    }


def _tolerances(assembly: Assembly) -> list[dict[str, Any]]:
    """Absolute tolerances and where each comes from."""
    options, size = assembly.options, assembly.ctx.scale
    # the rules of engine/dae/src/tolerances.rs in words
    length = f"{size.length:g} m ({size.length_of})" if size and size.length else "1 mm (no length is stated)"
    mass = f"{size.mass:g} kg ({size.mass_of})" if size and size.mass else "1 g (no mass is stated)"
    sources = {
        "vntol": "1e-6, as SPICE",
        "abstol": "1e-12, as SPICE",
        "lentol": f"1e-8 of {length}",
        "angtol": "1e-8",
        "veltol": f"1e-8 sqrt(g L), L = {length}",
        "spintol": "1e-6",
        "forcetol": f"1e-8 M g, M = {mass}",
        "torquetol": f"1e-8 M g L, M = {mass}, L = {length}",
    }
    # of the engine: how far these follow a reltol below 1e-3
    follows = options.get("reltol", 1e-3) < 1e-3
    found = []
    for quantity, unit, option, value, given in assembly.system.quantities(options):
        source = f".options {option}" if given else sources[option] + ("; follows reltol" if follows else "")
        found.append(dict(quantity=quantity, unit=unit, option=option, value=value, source=source))
    return found


def _formulations(assembly: Assembly) -> dict[str, Any]:
    """What the machine costs in the coordinates of its joints and in those of its bodies."""
    from ..assemble import assemble
    from ..assemble.options import FORMULATIONS
    from ..diagnostics import DeckError, Sink

    flat = assembly.flat
    found: dict[str, Any] = {}
    for formulation in FORMULATIONS:
        other: Assembly = assembly
        if formulation != assembly.options["formulation"]:
            if assembly.machine.graph().is_deep:
                found[formulation] = (
                    "not written out: bodies hang on so many joints that its work grows with their square"
                )
                continue
            said, flat.sink = flat.sink, Sink()
            try:
                options = {**assembly.options, "formulation": formulation}
                other = assemble(flat, options, assembly.ctx.times)
            except DeckError as trouble:
                found[formulation] = trouble.diagnostics[-1].message
                continue
            finally:
                flat.sink = said
        values, derivatives = other.system.operations
        found[formulation] = {
            "size": other.system.n,
            "rows": len(other.machine.rows),
            "nonzeros": len(other.system.pattern()[1]),
            "values": values,
            "with_derivatives": derivatives,
        }
    return found
