"""Coils that share a flux: which of them are drawn on one core, and how every K is told."""

from __future__ import annotations

from itertools import combinations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..elements import Element

MOST = 6  # windings of a drawn core


def cores(couplings: Sequence[Element], own: dict[str, Element]) -> list[tuple[list[Element], list[Element]]]:
    """(K lines, coils) of every core: coils that couplings tie together, as long as all of them stand on this level. What is left
    of `couplings` is written."""
    groups: list[tuple[list[Element], list[str]]] = []
    for k in couplings:
        names = list(k.extra["inductors"])
        tied = [g for g in groups if set(g[1]) & set(names)]
        lines = [*(line for g in tied for line in g[0]), k]
        coils = list(dict.fromkeys([*(name for g in tied for name in g[1]), *names]))
        groups = [*(g for g in groups if g not in tied), (lines, coils)]
    return [
        (lines, [own[name] for name in coils])
        for lines, coils in groups
        if 2 <= len(coils) <= MOST and all(name in own for name in coils)
    ]


def factors(lines: Sequence[Element], coils: Sequence[str], shown: dict[str, str]) -> list[str]:
    """The couplings of a core in words: one k where every pair has it, else each with its coils."""
    said = {line.name: factor(line) for line in lines}
    pairs = [frozenset(pair) for line in lines for pair in combinations(line.extra["inductors"], 2)]
    if len(set(said.values())) == 1 and len(pairs) == len(set(pairs)) == len(coils) * (len(coils) - 1) // 2:
        return [next(iter(said.values()))]
    return [written(line, shown) for line in lines]


def factor(line: Element) -> str:
    if line.model_name:
        return f"core {line.model_name}"
    return f"k = {line.value:.4g}" if isinstance(line.value, (int, float)) else "k = ?"


def written(line: Element, shown: dict[str, str]) -> str:
    """A K line by itself: k(L1,L2) = 0.99."""
    names = ",".join(shown.get(name, name) for name in line.extra["inductors"])
    said = factor(line)
    return f"k({names}){said[1:]}" if said.startswith("k") else f"{said} of {names}"


def turned(coils: Sequence[Element], ground: Sequence[str]) -> list[bool]:
    """Of coils above one another which stand on their heads, their first terminal below: so that what two of them share lies
    between them, and ground below."""
    found: list[bool] = []
    below = None
    for e in coils:
        first, second = e.nodes[:2]
        over = below == second if below in (first, second) else first in ground
        found.append(over)
        below = first if over else second
    return found
