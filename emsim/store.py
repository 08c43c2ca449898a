"""Where the columns of a table lie: in the engine's own bytes, or in plain Python."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from collections.abc import Iterable, Sequence
    from typing import Any, Protocol

    class Waves(Protocol):
        """The duty of a column store: the engine's Waveforms, or `Columns` below."""

        @property
        def rows(self) -> int: ...
        @property
        def columns(self) -> int: ...
        @property
        def corners(self) -> bytes: ...  # times, float64 too
        @property
        def steady(self) -> Sequence[bool]: ...  # columns that no corner bends
        def column(self, i: int, /) -> bytes: ...  # float64, native order; complex128 where `complex` says so

    # a store may have `complex`, a sequence of bool: which of its columns hold complex numbers; none where it is left out


class Columns:
    """A column store in plain Python: for tables that were read from a file or made by hand."""

    __slots__ = ("_data", "columns", "complex", "corners", "rows", "steady")

    def __init__(
        self,
        data: Iterable[bytes | Sequence[float]],
        corners: bytes = b"",
        steady: Sequence[bool] = (),
        complex: Sequence[bool] = (),
    ) -> None:
        from array import array

        self._data = [c if isinstance(c, bytes) else array("d", c).tobytes() for c in data]
        self.columns, self.corners, self.steady = len(self._data), corners, steady
        self.complex = list(complex)
        width = 16 if self.complex and self.complex[0] else 8
        self.rows = len(self._data[0]) // width if self._data else 0

    def column(self, i: int, /) -> bytes:
        return self._data[i]

    def __reduce__(self) -> tuple[Any, ...]:
        return Columns, (self._data, self.corners, self.steady, self.complex)


class Scene:
    """The drawing of a machine (assemble/drawing.py) or of a circuit (schematic/picture.py, assemble/flows.py) and the columns
    that move it, beside a table's time, or an `axis` of its own: modes swing while the page's clock stands at their number."""

    __slots__ = ("axis", "data", "waves")

    def __init__(self, data: dict[str, Any], waves: Waves, axis: array[float] | None = None) -> None:
        self.data, self.waves, self.axis = data, waves, axis

    def __reduce__(self) -> tuple[Any, ...]:
        columns = Columns(self.waves.column(k) for k in range(self.waves.columns))
        return Scene, (self.data, columns, self.axis)


def paired(
    names: Sequence[str], units: Sequence[str], columns: Sequence[bytes]
) -> tuple[list[str], list[str], Columns]:
    """What `Table.flat` took apart: re(name) and im(name) that stand side by side are one complex column again."""
    from array import array

    found: list[tuple[str, str, bytes, bool]] = []
    k = 0
    while k < len(names):
        name = names[k]
        inner = name[3:-1] if name.startswith("re(") and name.endswith(")") else None
        if inner is not None and k + 1 < len(names) and names[k + 1] == f"im({inner})":
            both = array("d", bytes(2 * len(columns[k])))
            both[::2], both[1::2] = array("d", columns[k]), array("d", columns[k + 1])
            found.append((inner, units[k], both.tobytes(), True))
            k += 2
            continue
        found.append((name, units[k], columns[k], False))
        k += 1
    store = Columns((f[2] for f in found), complex=[f[3] for f in found])
    return [f[0] for f in found], [f[1] for f in found], store
