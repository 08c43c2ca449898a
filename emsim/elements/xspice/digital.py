"""Digital parts of the engine as code models."""

from __future__ import annotations

from .base import CodeModel, Port, Seat, Word

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


class Part(CodeModel):
    """Everything about it is the engine's; a class here may say more of it."""

    engine: Any  # as `digital_parts` tells it

    def build(self, seat: Seat) -> None:
        self.place(seat, {})

    def place(self, seat: Seat, more: dict[str, list[float]]) -> None:
        """Puts it between its nodes, with its numbers and `more` of them."""
        ports = [[seat.digital(p.name, k) for k in range(seat.width(p.name))] for p in self.ports]
        given = {
            key: [float(v) for v in value] if isinstance(value, list) else [float(value)]
            for key, value in seat.values.items()
            if not isinstance(value, str)
        }
        seat.part(self.name, ports, {**given, **more})


def ports(told: list[tuple[str, bool, bool, bool]]) -> tuple[Port, ...]:
    return tuple(
        Port(name, ("d",), reads=not is_output, drives=is_output, is_list=is_list, is_open=is_open)
        for name, is_output, is_list, is_open in told
    )


def words(told: list[tuple[str, str, float, str]]) -> dict[str, Word]:
    return {
        name: Word(
            meaning, unit, default if default == default else None, "number" if default == default else "text"
        )
        for name, unit, default, meaning in told
    }


def of_part(told: Any) -> type[CodeModel]:
    name, what, its_ports, parameters = told
    return type(
        name,
        (Part,),
        {"name": name, "what": what, "ports": ports(its_ports), "parameters": words(parameters)},
    )
