"""What `emsim.run` returns: an outcome that can be saved, drawn, and shown by notebooks."""

from __future__ import annotations

from .outcome import Outcome

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from os import PathLike
    from typing import Any

    from .outputs.picture import Picture


class Result(Outcome):
    def save(self, path: str | PathLike[str], **options: Any) -> None:
        """Writes a file in the format of its extension: .raw (ascii=True for text), .csv (units=True for a
        line of units), .txt, .parquet, .nc, .html (the page). ValueError for any other, OutsideError where it
        cannot be written."""
        from .outputs import save

        save(self, path, **options)

    def plot(
        self, *signals: str, degrees: bool | None = None, start: float | None = None, stop: float | None = None,
        width: int = 1080,
    ) -> Picture:  # fmt: skip
        """A matplotlib Figure of signals, a panel a unit: plot("v(out) i(v1)"), plot("omega(hinge) vs angle(hinge)").

        Each argument is a list of signals or expressions as .print takes them; none: what .print asks for. `degrees`
        shows rad as deg; left out: where the deck writes degrees. `start`, `stop` [s] cut the axis. `width` in pixels.
        DeckError for signals that are not there, OutsideError without matplotlib."""
        from .outputs import html, panels, picture

        asked = signals or (" ".join(html.shown(self, self.main)),)
        angles = panels.writes_degrees(self.deck) if degrees is None else degrees
        return picture.picture(panels.panels(self.main, asked, angles, start, stop), self.title, width)

    def _repr_html_(self) -> str:
        """For notebooks: a table of the signals, and the page."""
        from .outputs import notebook

        return notebook.result(self)

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        """Text and HTML; a PNG only where it is asked for, since drawing it takes longer than most runs."""
        makers: dict[str, Callable[[], Any]] = {"text/plain": self.__repr__, "text/html": self._repr_html_}
        if include and "image/png" in include and self.plots and len(self.main) > 1:
            makers["image/png"] = lambda: self.plot()._repr_png_()
        return {
            kind: make()
            for kind, make in makers.items()
            if not (include and kind not in include) and not (exclude and kind in exclude)
        }
