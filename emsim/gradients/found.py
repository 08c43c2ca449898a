"""What a gradient is: values, and a matrix with names."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    import numpy as np

    from ..diagnostics import Diagnostic


class Gradient:
    """Values of measures and their derivatives by quantities.

    names    of the measures; a signal at a place is `v(out)@0.001`
    by       names of the quantities
    values   array (measures,), real, or complex of signals over frequency
    matrix   array (measures, quantities): derivatives, in units of the measure over those of the quantity
    remarks  what is to be said of them: diagnostics
    """

    def __init__(
        self,
        names: Sequence[str],
        by: Sequence[str],
        values: np.ndarray,
        matrix: np.ndarray,
        remarks: Sequence[Diagnostic] = (),
    ) -> None:
        self.names, self.by = list(names), list(by)
        self.values, self.matrix, self.remarks = values, matrix, list(remarks)

    def __repr__(self) -> str:
        return f"<Gradient of {', '.join(self.names)} by {', '.join(self.by)}>"

    def __getitem__(self, key: str | tuple[str, str]) -> Any:
        """The derivative g["vmax", "r1"], or the value g["vmax"]. Raises KeyError."""
        name, by = (key, None) if isinstance(key, str) else key
        row = _place(self.names, name)
        return self.values[row] if by is None else self.matrix[row, _place(self.by, by)]

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """Measure -> quantity -> derivative."""
        return {
            name: dict(zip(self.by, row.tolist(), strict=True))
            for name, row in zip(self.names, self.matrix, strict=True)
        }

    def to_pandas(self) -> Any:
        """A DataFrame: a row a measure, a column a quantity."""
        import pandas

        return pandas.DataFrame(self.matrix, index=self.names, columns=self.by)


def _place(names: list[str], name: str) -> int:
    word = "".join(name.split()).lower()
    if word not in names:
        raise KeyError(f"no {name!r}: there are {', '.join(names)}")
    return names.index(word)
