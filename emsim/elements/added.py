"""The user's own models: texts in Verilog-A that `emsim models add` has read once, found by level and by name of module from then
on. Each is a folder of its own, with its files and `model.json`, below `folder()`."""

from __future__ import annotations

import os

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink, Span
    from .modules import Module
    from .public import Public

CARD = "model.json"


def folder() -> str:
    """EMSIM_MODELS, or emsim/models where data of the user's is kept (XDG Base Directory Specification 0.8)."""
    if own := os.environ.get("EMSIM_MODELS"):
        return own
    data = os.environ.get("XDG_DATA_HOME") or os.path.join(os.path.expanduser("~"), ".local", "share")
    return os.path.join(data, "emsim", "models")


class Added:
    """One module: its name, the file that holds it, the letter and the levels by which elements find it, the public model that it
    is (its title, or ""), and a digest of its text, which tells one version from another."""

    __slots__ = ("digest", "file", "letter", "levels", "module", "title")

    def __init__(
        self, module: str, file: str, letter: str, levels: list[int], title: str, digest: str
    ) -> None:
        self.module, self.file, self.letter, self.levels = module, file, letter, levels
        self.title, self.digest = title, digest

    def words(self) -> dict[str, Any]:
        """What stands in `model.json`, but for the file, which is relative to it."""
        return {name: getattr(self, name) for name in ("module", "letter", "levels", "title", "digest")}

    def where(self) -> str:
        return f"{os.path.basename(self.file)} ({self.digest})"


def all_of_them() -> list[Added]:
    """What was added, by name. A folder that is none of these is left out."""
    import json

    top, found = folder(), []
    try:
        names = sorted(os.listdir(top))
    except OSError:
        return []
    for name in names:
        if name.startswith("."):
            continue  # one that is being written
        try:
            with open(os.path.join(top, name, CARD), encoding="utf-8") as file:
                words = json.load(file)
            path = os.path.join(top, name, words.pop("file"))
            found.append(Added(file=path, **words))
        except (OSError, ValueError, KeyError, TypeError):
            continue
    return found


def of_level(letter: str, level: int) -> Added | None:
    return next((a for a in all_of_them() if a.letter == letter and level in a.levels), None)


class Library:
    """What was added, as one run finds it: each text is read once, and the run says which file it took."""

    def __init__(self, sink: Sink) -> None:
        self.sink = sink
        self.found: dict[object, Module | None] = {}
        self.broken: set[object] = set()  # keys whose text can be read no more, which was told

    def by_level(self, letter: str, level: int, at: Span) -> Module | None:
        """The module that serves a level."""
        key = (letter, level)
        if key not in self.found:
            entry = of_level(letter, level)
            self.found[key] = self._taken(key, entry, f"level {level} is", at) if entry else None
        return self.found[key]

    def by_model(self, models: list[Public], at: Span) -> Module | None:
        """The module of the first public model that was added."""
        titles = [model.title for model in models]
        entry = next((a for a in all_of_them() if a.title in titles), None)
        return self.by_name(entry.module, at) if entry else None

    def by_name(self, name: str, at: Span) -> Module | None:
        """The module of a name, of whatever case."""
        key = name.lower()
        if key not in self.found:
            entry = next((a for a in all_of_them() if a.module.lower() == key), None)
            self.found[key] = self._taken(key, entry, f"`{name}` is", at) if entry else None
        return self.found[key]

    def _taken(self, key: object, entry: Added, what: str, at: Span) -> Module | None:
        """Reads the text. One that can be read no more is an error, as its level would be another model elsewhere."""
        from .modules import ModuleError, read, where

        module, told = None, []
        try:
            module = next((m for m in read(entry.file) if m.name == entry.module), None)
        except OSError as error:
            told = [("E501", f"cannot read {entry.file}: {error.strerror or error}")]
        except ModuleError as trouble:
            told = [("E154", message["text"] + where(message)) for message in trouble.messages]
        if module is None:
            self.broken.add(key)
        for code, text in told or [("E154", f"{entry.file} has no module `{entry.module}`")] * (
            module is None
        ):
            self.sink.error(code, text, at, f"emsim models remove {entry.module}, and add it again")
        if module is not None:
            self.sink.note(
                "N286", f"{what} the module `{module.name}` of {entry.where()}, which `emsim models add` put there", at,
                "another machine needs it too; a .hdl of the deck goes before it",
            )  # fmt: skip
        return module


def free_levels(
    module: str, letter: str, levels: list[int], built_in: dict[int, str]
) -> tuple[list[int], list[str]]:
    """Of the levels of a module those that nothing else has, and what is told of the others."""
    from .modules import shipped

    free, said = [], []
    for level in levels:
        other = of_level(letter, level)
        if level in built_in and shipped(built_in[level]) is not None:
            said.append(f"level {level} is built in ({built_in[level]}) and stays so")
        elif other is not None and other.module.lower() != module.lower():
            said.append(
                f"level {level} is `{other.module}` already: emsim models remove {other.module} frees it"
            )
        else:
            free.append(level)
    return free, said


def is_built_in(name: str) -> bool:
    from .modules import shipped

    return shipped(name.lower()) is not None


def files_of(module: Module, path: str) -> list[str]:
    """The files that a module is made of, but for those that come with emsim."""
    from .modules import FOLDER as own

    files = {os.path.abspath(file) for file in (path, *module.texts.files)}
    # some that every text may include have a name and no file
    texts = [file for file in files if os.path.isfile(file) and not file.startswith(own + os.sep)]
    return sorted({*texts, *(table for file in texts for table in _tables(file))})


def _tables(file: str) -> list[str]:
    """The files that $table_model reads in a text: what it names between quotes, and lies beside it."""
    import re

    with open(file, encoding="utf-8", errors="replace") as opened:
        text = opened.read()
    names = re.findall(r'"([^"\n]+)"', text) if "$table_model" in text else []
    beside = [os.path.normpath(os.path.join(os.path.dirname(file), name)) for name in names]
    return [*filter(os.path.isfile, beside)]


def copied(module: Module, path: str) -> tuple[str, str]:
    """Copies a module's files, as they lie to each other, into a new folder below `folder()`, which no run looks into: that
    folder, and the text in it. Raises OSError."""
    import shutil

    text, files = os.path.abspath(path), files_of(module, path)
    root = os.path.commonpath([os.path.dirname(file) for file in files])
    made = os.path.join(folder(), f".{module.name.lower()}.{os.getpid()}")
    for file in files:
        target = os.path.join(made, os.path.relpath(file, root))
        os.makedirs(os.path.dirname(target), exist_ok=True)
        shutil.copyfile(file, target)
    return made, os.path.join(made, os.path.relpath(text, root))


def keep(made: str, entry: Added) -> None:
    """Gives a folder that `copied` made its card and its name; what had that name goes. Raises OSError."""
    import json
    import shutil

    place = os.path.join(folder(), entry.module.lower())
    if os.path.lexists(place) and not os.path.isfile(os.path.join(place, CARD)):
        raise OSError(f"{place} is there already, and is no model")
    with open(os.path.join(made, CARD), "w", encoding="utf-8") as file:
        json.dump(entry.words() | {"file": os.path.relpath(entry.file, made)}, file, indent=1)
    shutil.rmtree(place, ignore_errors=True)
    os.rename(made, place)
