"""A deck as a function of numbers, with its derivatives: what JAX and PyTorch are given (emsim.jax, emsim.torch).

f = Function("servo.cir", of=["miss", "energy"], by=["u1", "u2"])
f.values([1.0, 2.0])    # array (measures,)
f.both([1.0, 2.0])      # that, and the matrix (measures, quantities)
"""

from __future__ import annotations

from . import pipeline
from .diagnostics import Sink, Span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    import numpy as np

    from .gradients import Gradient
    from .source import Source


class Function:
    """Measures of a deck as a function of quantities, in the order of `by`; `of`, `at` and `analysis` as `emsim.Deck.gradient`
    takes them, `defines` and `options` as `emsim.run`. Values and derivatives of the last numbers are kept.

    Raises DeckError, ConvergenceError; TypeError for measures that are complex."""

    @pipeline.explained
    def __init__(
        self,
        source: Source,
        of: Sequence[str] | str | None,
        by: Sequence[str] | str,
        at: Sequence[float] | float | None = None,
        analysis: str | None = None,
        defines: Mapping[str, Any] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> None:
        from .elaborate.quantity import value

        self.of, self.at = of, at
        self.by = ["".join(name.split()).lower() for name in ([by] if isinstance(by, str) else by)]
        self.options = {key.lower(): value for key, value in (options or {}).items()}
        self.deck = pipeline.load(source, defines, analyses=analysis, options=self.options)
        self.said = list(self.deck.sink.diagnostics)
        flat = pipeline.flatten(self.deck, self.options)
        self.start = [value(flat, name) for name in self.by]
        self._last: tuple[bytes, Gradient] | None = None
        self.names = self.found(self.start, slopes=False).names

    @pipeline.explained
    def found(self, numbers: Sequence[float] | np.ndarray, slopes: bool = True) -> Gradient:
        """The gradient with these values of the quantities, array (quantities,); without `slopes` the values alone."""
        import numpy as np

        from .elaborate.quantity import with_values
        from .gradients import gradient

        x = np.ascontiguousarray(numbers, float)
        if x.shape != (len(self.by),):
            raise ValueError(f"{x.shape} numbers for {len(self.by)} quantities: {', '.join(self.by)}")
        if self._last is not None and self._last[0] == x.tobytes() and (self._last[1].by or not slopes):
            return self._last[1]
        given = dict(zip(self.by, x.tolist(), strict=True))
        options = {**self.options, **({"temp": given["temp"]} if "temp" in given else {})}
        place = Span(self.deck.file, 1, 1, 2)
        flat = with_values(self.deck, given, place, options.get("temp"), said=self.said)
        flat.sink = Sink()
        found = gradient(flat, self.of, self.by if slopes else (), self.at, options)
        if np.iscomplexobj(found.values):
            raise TypeError(
                "signals over frequency are complex numbers: measure what is real, as max(vm(out))"
            )
        self._last = (x.tobytes(), found)
        return found

    def values(self, numbers: Sequence[float] | np.ndarray) -> np.ndarray:
        """The measures, array (measures,)."""
        found: np.ndarray = self.found(numbers, slopes=False).values
        return found

    def both(self, numbers: Sequence[float] | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The measures, and their derivatives, array (measures, quantities)."""
        found = self.found(numbers)
        return found.values, found.matrix
