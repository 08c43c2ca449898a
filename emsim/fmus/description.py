"""modelDescription.xml: what an FMU tells of itself, in the words of FMI 2.0 and 3.0."""

from __future__ import annotations

import re
from math import pi
from xml.sax.saxutils import quoteattr

from .._engine import __version__

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

# unit -> exponents of kg, m, s, A, K, rad
BASES = ("kg", "m", "s", "A", "K", "rad")
UNITS: dict[str, tuple[int, ...]] = {
    "kg": (1, 0, 0, 0, 0, 0), "m": (0, 1, 0, 0, 0, 0), "s": (0, 0, 1, 0, 0, 0), "A": (0, 0, 0, 1, 0, 0),
    "K": (0, 0, 0, 0, 1, 0), "rad": (0, 0, 0, 0, 0, 1), "Hz": (0, 0, -1, 0, 0, 0), "N": (1, 1, -2, 0, 0, 0),
    "J": (1, 2, -2, 0, 0, 0), "W": (1, 2, -3, 0, 0, 0), "V": (1, 2, -3, -1, 0, 0), "Ohm": (1, 2, -3, -2, 0, 0),
    "F": (-1, -2, 4, 2, 0, 0), "H": (1, 2, -2, -2, 0, 0), "Wb": (1, 2, -2, -1, 0, 0), "T": (1, 0, -2, -1, 0, 0),
}  # fmt: skip
# base unit = factor * unit + offset
SCALED = {
    "deg": ((0, 0, 0, 0, 0, 1), pi / 180.0, 0.0),
    "rpm": ((0, 0, -1, 0, 0, 1), pi / 30.0, 0.0),
    "C": ((0, 0, 0, 0, 1, 0), 1.0, 273.15),
}

_CATEGORIES = (
    '<LogCategories><Category name="logStatusError"/><Category name="logStatusWarning"/></LogCategories>'
)


class Variable:
    """One variable: `causality` independent, input, parameter, output, local; `variability` continuous, tunable, fixed;
    `start` where
    it has one; `derivative`: value reference of the state whose rate it is; `nominal` of a state; `role`: state, rate, indicator
    of what is local."""

    __slots__ = ("causality", "derivative", "name", "nominal", "role", "says", "start", "unit", "variability")

    def __init__(
        self,
        name: str,
        causality: str,
        unit: str,
        start: float | None = None,
        says: str = "",
        variability: str = "continuous",
    ) -> None:
        self.variability = variability
        self.name, self.causality, self.unit, self.start, self.says = name, causality, unit, start, says
        self.role = ""
        self.derivative: int | None = None
        self.nominal: float | None = None

    @property
    def initial(self) -> str | None:
        return "calculated" if self.causality == "output" or self.role else None

    def __repr__(self) -> str:
        return f"{self.variability} {self.causality} {self.name} [{self.unit}] {self.start!r} {self.role} {self.nominal!r}"


class Model:
    """What the head of the description says: name of the library, title, token, end and step of the experiment [s], tolerance,
    kinds (cosim, model), is a state kept, are there directional derivatives."""

    __slots__ = ("can_return", "kinds", "name", "reltol", "slopes", "title", "token", "tstep", "tstop")

    def __init__(
        self,
        names: tuple[str, str, str],
        experiment: tuple[float, float, float],
        kinds: Sequence[str],
        can_return: bool,
        slopes: bool,
    ) -> None:
        self.name, self.title, self.token = names
        self.tstop, self.tstep, self.reltol = experiment
        self.kinds, self.can_return, self.slopes = tuple(kinds), can_return, slopes


def text(model: Model, variables: Sequence[Variable], version: int) -> str:
    """The file's text."""
    lines = _two(model, variables) if version == 2 else _three(model, variables)
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', *lines, ""])


def exponents(unit: str) -> tuple[tuple[int, ...], float, float] | None:
    """(exponents of the base units, factor, offset) of a unit as emsim writes it, `kg m^2/s`; None for one of no such kind."""
    if unit in SCALED:
        return SCALED[unit]
    found = [0] * len(BASES)
    above, *below = unit.split("/")
    for sign, part in ((1, above), *((-1, p) for p in below)):
        for word in part.split():
            match = re.fullmatch(r"([A-Za-z]+)(?:\^(-?\d+))?", word)
            if match is None or match[1] not in UNITS:
                if word == "1":
                    continue
                return None
            for k, power in enumerate(UNITS[match[1]]):
                found[k] += sign * power * int(match[2] or 1)
    return tuple(found), 1.0, 0.0


def _element(element: str, /, ends: bool = True, **attributes: object) -> str:
    words = [f"{key}={quoteattr(_word(value))}" for key, value in attributes.items() if value is not None]
    return f"<{' '.join([element, *words])}{'/' if ends else ''}>"


def _word(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, float) else str(value)


def _units(variables: Sequence[Variable]) -> list[str]:
    found = list(dict.fromkeys(v.unit for v in variables if v.unit))
    lines = ["  <UnitDefinitions>"]
    for unit in found:
        base = exponents(unit)
        if base is None:
            lines.append("    " + _element("Unit", name=unit))
            continue
        powers, factor, offset = base
        own: dict[str, object] = {b: p for b, p in zip(BASES, powers, strict=True) if p}
        if factor != 1.0:
            own["factor"] = factor
        if offset:
            own["offset"] = offset
        inner = _element("BaseUnit", True, **own)
        lines.append("    " + _element("Unit", ends=False, name=unit) + inner + "</Unit>")
    return [*lines, "  </UnitDefinitions>"] if found else []


def _experiment(model: Model) -> str:
    return "  " + _element(
        "DefaultExperiment", startTime=0.0, stopTime=model.tstop, tolerance=model.reltol, stepSize=model.tstep
    )


def _kinds(model: Model, version: int) -> list[str]:
    """The elements of what the FMU is for."""
    keeps = {"canGetAndSetFMUstate" if version == 2 else "canGetAndSetFMUState": model.can_return}
    own: dict[str, object] = {"modelIdentifier": model.name}
    exchange = {**own, **keeps}
    if version == 2:
        exchange |= {"completedIntegratorStepNotNeeded": False, "providesDirectionalDerivative": model.slopes}
        couple = {
            **own,
            "canHandleVariableCommunicationStepSize": True,
            "canInterpolateInputs": True,
            **keeps,
        }
    else:
        exchange |= {"needsCompletedIntegratorStep": True, "providesDirectionalDerivatives": model.slopes}
        couple = {**own, "canHandleVariableCommunicationStepSize": True, **keeps}
        couple |= {"canReturnEarlyAfterIntermediateUpdate": False, "hasEventMode": False}
    found = [("model", "ModelExchange", exchange), ("cosim", "CoSimulation", couple)]
    return ["  " + _element(tag, True, **words) for kind, tag, words in found if kind in model.kinds]


def _places(variables: Sequence[Variable], *roles: str) -> list[int]:
    return [k for k, v in enumerate(variables) if (v.role or v.causality) in roles]


def _three(model: Model, variables: Sequence[Variable]) -> list[str]:
    lines = [
        _element(
            "fmiModelDescription", ends=False, fmiVersion="3.0", modelName=model.title, instantiationToken=model.token,
            generationTool=f"emsim {__version__}", variableNamingConvention="flat",
        ),
        *_kinds(model, 3),
        *_units(variables),
        "  " + _CATEGORIES,
        _experiment(model),
        "  <ModelVariables>",
    ]  # fmt: skip
    for k, v in enumerate(variables):
        lines.append(
            "    " + _element(
                "Float64", name=v.name, valueReference=k, description=v.says or None, causality=v.causality,
                variability=v.variability, initial=v.initial,
                unit=v.unit or None, nominal=v.nominal, derivative=v.derivative, start=v.start,
            )
        )  # fmt: skip
    lines += ["  </ModelVariables>", "  <ModelStructure>"]
    for word, roles in (
        ("Output", ["output"]),
        ("ContinuousStateDerivative", ["rate"]),
        ("InitialUnknown", ["output", "state", "rate"]),
        ("EventIndicator", ["indicator"]),
    ):
        lines += ["    " + _element(word, valueReference=k) for k in _places(variables, *roles)]
    return [*lines, "  </ModelStructure>", "</fmiModelDescription>"]


def _two(model: Model, variables: Sequence[Variable]) -> list[str]:
    indicators = len(_places(variables, "indicator"))
    lines = [
        _element(
            "fmiModelDescription", ends=False, fmiVersion="2.0", modelName=model.title, guid=model.token,
            generationTool=f"emsim {__version__}", variableNamingConvention="flat",
            numberOfEventIndicators=indicators or None,
        ),
        *_kinds(model, 2),
        *_units(variables),
        "  " + _CATEGORIES,
        _experiment(model),
        "  <ModelVariables>",
    ]  # fmt: skip
    for k, v in enumerate(variables):
        head = _element(
            "ScalarVariable", ends=False, name=v.name, valueReference=k, description=v.says or None, causality=v.causality,
            variability=v.variability, initial=v.initial,
        )  # fmt: skip
        index = None if v.derivative is None else v.derivative + 1
        real = _element("Real", unit=v.unit or None, nominal=v.nominal, start=v.start, derivative=index)
        lines.append(f"    {head}{real}</ScalarVariable>")
    lines += ["  </ModelVariables>", "  <ModelStructure>"]
    for word, roles in (
        ("Outputs", ["output"]),
        ("Derivatives", ["rate"]),
        ("InitialUnknowns", ["output", "state", "rate"]),
    ):
        if places := _places(variables, *roles):
            lines += [
                f"    <{word}>",
                *("      " + _element("Unknown", index=k + 1) for k in places),
                f"    </{word}>",
            ]
    return [*lines, "  </ModelStructure>", "</fmiModelDescription>"]
