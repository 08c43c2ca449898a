"""Includes and libraries: where a named file is, and the cards it puts in place of the .include or .lib."""

from __future__ import annotations

import os

from ..build import read_file
from ..deck import Deck, Dot, Include
from ..diagnostics import Sink, did_you_mean, suggest
from ..expr import Call, Name
from ..source import MOST_BYTES, read_bytes

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..deck import MachineCard
    from ..readers.surface import Surface
    from ..source import SourceFile

# what a bare name means where no such file lies beside the deck: servo.lib, pid.lib, ..
LIBRARY = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "lib")
# the libraries that LTspice names in every netlist, whether the deck takes a model of them or not
STANDARD = frozenset(f"standard.{kind}" for kind in ("bjt", "dio", "mos", "jft", "res", "cap", "ind", "bead"))
MAX_DEPTH = 50  # files within files
MAX_INCLUDES = 10_000  # files put in place of a card; each may be the same one
MAX_TEXT = MOST_BYTES  # characters that come in all, each file as often as it is included


class Files:
    """Reads included files, each once, relative to the file that names them."""

    def __init__(self, sink: Sink, sources: list[SourceFile], named: list[str] | None = None) -> None:
        self.sink = sink
        self.sources = sources
        self.named = [] if named is None else named  # every path that was looked for
        self._decks: dict[str, Deck] = {}
        self._count = self._size = 0

    def cards(self, card: Include, chain: tuple[str, ...]) -> tuple[list[Any], tuple[str, ...]]:
        """The cards of an include and the chain of open files with it; nothing, with a diagnostic, on failure."""
        including = card.span.file
        base = os.path.dirname(including.path) if including.path else "."
        path = os.path.normpath(os.path.join(base, os.path.expanduser(card.path.replace("\0", ""))))
        if "\\" in path and not os.path.exists(path):
            path = os.path.normpath(path.replace("\\", os.sep))  # a path as Windows writes it
        if path not in self.named:
            self.named.append(path)
        if os.path.basename(card.path) == card.path and not os.path.exists(path):
            shipped = os.path.join(LIBRARY, card.path)
            path = shipped if os.path.isfile(shipped) else path
        key = os.path.realpath(path)
        link = key if card.section is None else f"{key}\0{card.section}"
        if link in chain:
            self.sink.error("E151", f"{card.path} includes itself", card.span)
            return [], chain
        if len(chain) >= MAX_DEPTH:
            self._too_much(card, f"{MAX_DEPTH} files within files are the most")
            return [], chain
        deck = self._decks.get(key)
        if deck is None:
            deck = self._read(path, card)
            if deck is None:
                return [], chain
            self._decks[key] = deck
        self._count += 1
        self._size += len(deck.file.text)
        if self._count > MAX_INCLUDES or self._size > MAX_TEXT:
            # said once; what doubles forty times over would be said as often
            if self._count <= MAX_INCLUDES + 1:
                self._too_much(
                    card, f"{MAX_INCLUDES:,} files, or {MAX_TEXT >> 20} MiB of text, are the most in all"
                )
            self._count = MAX_INCLUDES + 1
            return [], chain
        if card.section is None:
            return deck.body, (*chain, link)
        if card.section not in deck.sections:
            known = ", ".join(deck.sections) or "none"
            self.sink.error(
                "E152",
                f"{card.path} has no section `{card.section}`",
                card.span,
                did_you_mean(card.section, deck.sections, f"its sections: {known}"),
            )
            return [], chain
        return deck.sections[card.section], (*chain, link)

    def modules(self, card: Dot, known: dict[str, Any]) -> None:
        """The Verilog-A modules of a file that .hdl names; of a library compiled for ngspice (x.osdi) the text beside it."""
        from ..elements.modules import ModuleError, read, where

        base = os.path.dirname(card.span.file.path) if card.span.file.path else "."
        given = str(card.items).replace("\0", "")
        path = os.path.normpath(os.path.join(base, os.path.expanduser(given)))
        if path.endswith(".osdi"):
            path = path[: -len("osdi")] + "va"
        if path not in self.named:
            self.named.append(path)
        try:
            found = read(path)
        except ModuleError as trouble:
            for message in trouble.messages:
                self.sink.error("E154", message["text"] + where(message), card.span, message["hint"] or None)
            return
        except OSError as error:
            hint = did_you_mean(
                os.path.basename(path), _listing(os.path.dirname(path) or "."), f"looked for {path}"
            )
            self.sink.error("E501", f"cannot read {given}: {error.strerror or error}", card.span, hint)
            return
        known.update({module.name.lower(): module for module in found})

    def mesh(self, card: MachineCard, look: Call, known: dict[str, Surface], key: str = "look") -> None:
        """The surface that `stl(file)` names, of look=, under the path that then stands for it; on failure the card loses it."""
        from ..readers import stl, surface

        place = card.param_spans[key]
        given = look.args[0].id if look.args and isinstance(look.args[0], Name) else ""
        if not given or given[0] in "\"'{":
            said = (
                "stl(..) names a file" if not given else "the name of a file stands without quotes or braces"
            )
            self.sink.error("E232", said, place, "write stl(part.stl), in millimetres stl(part.stl,1m)")
            del card.params[key]
            return
        file = card.span.file
        base = os.path.dirname(file.path) if file.path else "."
        path = os.path.normpath(os.path.join(base, os.path.expanduser(given.replace("\0", ""))))
        if path not in self.named:
            self.named.append(path)
        try:
            if path not in known:
                found = stl.triangles(read_bytes(path, regular=True))
                # some 9 bytes each in a page, which is to stay below a megabyte, its engine included
                if len(found) > 20_000:
                    raise ValueError(f"it has {len(found):,} triangles, and 20,000 are the most")
                known[path] = surface.welded(found)
            card.params[key] = Call(look.fn, [Name(path, look.args[0].at), *look.args[1:]], look.at)
            return
        except FileNotFoundError:
            near = suggest(os.path.basename(path), _listing(os.path.dirname(path) or "."))
            hint = (f"did you mean `{near}`?\n" if near else "") + f"looked for {path}"
            self.sink.error("E501", f"there is no file {given}", place, hint)
        except OSError as error:
            self.sink.error("E501", f"cannot read {given}: {error.strerror or error}", place)
        except ValueError as error:
            hint = "a page of a megabyte holds no more; the program that wrote it can write it coarser"
            self.sink.error("E158", f"{given}: {error}", place, hint if "the most" in str(error) else None)
        del card.params[key]

    def _too_much(self, card: Include, most: str) -> None:
        hint = "a file that several others need is included once, by the deck"
        self.sink.error("E153", f"with {card.path} too much is included: {most}", card.span, hint)

    def _read(self, path: str, card: Include) -> Deck | None:
        try:
            ours = path.startswith(LIBRARY + os.sep)
            dialect = None if ours else card.span.file.dialect
            deck = read_file(path, self.sink, card.span, card.path, dialect)
        except FileNotFoundError:
            if os.path.basename(path).lower() in STANDARD:
                said = f"{card.path} comes with LTspice and is not here: models that the deck takes of it are missing"
                self.sink.warning(
                    "W154", said, card.span, "copy it beside the deck, or write the .model of what is used"
                )
                return None
            folder = os.path.dirname(path) or "."
            near = suggest(os.path.basename(path), [*_listing(folder), *_listing(LIBRARY)])
            self.sink.error(
                "E501",
                f"there is no file {card.path}",
                card.span,
                (f"did you mean `{near}`?\n" if near else "") + f"looked for {path}",
            )
            return None
        except IsADirectoryError:
            self.sink.error("E501", f"{card.path} is a directory", card.span)
            return None
        except OSError as error:
            self.sink.error("E501", f"cannot read {card.path}: {error.strerror or error}", card.span)
            return None
        except ValueError:
            self.sink.error("E100", f"{card.path} is not a text file", card.span)
            return None
        self.sources.append(deck.file)
        return deck


def _listing(folder: str) -> list[str]:
    try:
        return os.listdir(folder)
    except OSError:
        return []
