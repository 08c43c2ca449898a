"""modelDescription.xml of an FMU that a deck uses: what it is, what its variables are.

(FMI 2.0.4, section 2.2; FMI 3.0.2, section 2.4.)
"""

from __future__ import annotations

import os
import sys
import zipfile
import zlib

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

# names of types in FMI 2, and what they are in FMI 3
OLD = {
    "Real": "Float64",
    "Integer": "Int32",
    "Enumeration": "Int32",
    "Boolean": "Boolean",
    "String": "String",
}
FLOATS = ("Float64", "Float32")
NUMBERS = frozenset("Float64 Float32 Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64 Boolean".split())
# what the folder of a library is called: of this system and processor, in FMI 3 and in FMI 2
SYSTEMS = {
    "linux": ("linux", "linux", ".so"),
    "darwin": ("darwin", "darwin", ".dylib"),
    "win32": ("windows", "win", ".dll"),
}
PROCESSORS = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}


class FmuError(ValueError):
    """Why a file cannot be used as an FMU, and what may help."""

    def __init__(self, said: str, hint: str = "") -> None:
        super().__init__(said)
        self.said, self.hint = said, hint


class Variable:
    __slots__ = (
        "causality",
        "derivative",
        "initial",
        "is_array",
        "kind",
        "name",
        "reference",
        "start",
        "unit",
        "variability",
    )

    def __init__(self, name: str, reference: int, kind: str, given: dict[str, str], is_array: bool) -> None:
        self.name, self.reference, self.kind, self.is_array = name, reference, kind, is_array
        self.causality = given.get("causality", "local")
        self.variability = given.get("variability", "")
        self.initial = given.get("initial", "")
        self.start = given.get("start")
        self.unit = given.get("unit", "")
        self.derivative: int | None = None  # FMI 2: index of the state from 1, FMI 3: its value reference

    @property
    def is_settable(self) -> bool:
        """Before the start (FMI 2.0.4, table in section 2.2.7; FMI 3.0.2, section 2.4.7.5)."""
        if self.variability == "constant" or self.causality in ("structuralParameter", "independent"):
            return False
        return self.causality in ("parameter", "input") or self.initial in ("exact", "approx")

    def __repr__(self) -> str:
        return f"{self.kind} {self.causality} {self.name}"


class Described:
    """`couples` and `exchanges`: attributes of the element of its kind, or None."""

    def __init__(self, data: bytes, path: str) -> None:
        from xml.etree import ElementTree

        self.path = path
        try:
            root = ElementTree.fromstring(data)
        except ElementTree.ParseError as error:
            raise FmuError(f"the description in {path} is no XML: {error}") from None
        written = root.get("fmiVersion", "")
        if root.tag != "fmiModelDescription" or not written.startswith(("2.", "3.")):
            raise FmuError(
                f"{path} is of FMI {written or 'of an unknown version'}", "FMI 2.0 and 3.0 are read"
            )
        self.version = int(written[0])
        self.token = root.get("guid" if self.version == 2 else "instantiationToken", "")
        self.name = root.get("modelName", "")
        self.couples = self._kind(root, "CoSimulation")
        self.exchanges = self._kind(root, "ModelExchange")
        self.step = _number(root.find("DefaultExperiment"), "stepSize")
        self.indicators = 0
        self.derivatives: list[Variable] = []
        self.arrays: list[str] = []  # of derivatives and event indicators
        try:
            self.order = list(self._variables(root))
            self.variables = {v.name: v for v in self.order}
            self._structure(root)
        except FmuError:
            raise
        except (ValueError, TypeError, LookupError) as error:
            raise FmuError(f"the description in {path} cannot be read: {error}") from None

    @staticmethod
    def _kind(root: Any, tag: str) -> dict[str, str] | None:
        found = root.find(tag)
        return None if found is None else dict(found.attrib)

    def _variables(self, root: Any) -> Iterator[Variable]:
        for element in root.findall("ModelVariables/*"):
            given, kind, inner = dict(element.attrib), element.tag, element
            if self.version == 2:
                inner = next((child for child in element if child.tag in OLD), None)
                if inner is None:
                    continue
                given, kind = {**inner.attrib, **given}, OLD[inner.tag]
            elif kind == "Enumeration":
                kind = "Int64"
            is_array = any(child.tag == "Dimension" for child in element)
            found = Variable(
                given.get("name", ""), int(given.get("valueReference", 0)), kind, given, is_array
            )
            if "derivative" in given:
                found.derivative = int(given["derivative"])
            yield found

    def _structure(self, root: Any) -> None:
        """States and their derivatives in their order, and how many event indicators."""
        if self.version == 2:
            self.indicators = int(root.get("numberOfEventIndicators", 0))
            rows = root.findall("ModelStructure/Derivatives/Unknown")
            by = dict(enumerate(self.order, 1))
            self.derivatives = [by[int(row.get("index"))] for row in rows]
            return
        by = {v.reference: v for v in self.order}
        events = [by[int(row.get("valueReference"))] for row in root.findall("ModelStructure/EventIndicator")]
        rows = root.findall("ModelStructure/ContinuousStateDerivative")
        self.indicators = len(events)
        self.derivatives = [by[int(row.get("valueReference"))] for row in rows]
        self.arrays = [v.name for v in (*self.derivatives, *events) if v.is_array]

    def state(self, derivative: Variable) -> Variable:
        """Whose derivative it is. Raises FmuError."""
        k = derivative.derivative
        if self.version == 2 and k is not None and 0 < k <= len(self.order):
            return self.order[k - 1]
        found = next((v for v in self.order if self.version == 3 and v.reference == k), None)
        if found is None:
            raise FmuError(
                f"the description of {self.path} does not say whose derivative `{derivative.name}` is"
            )
        return found

    def find(self, name: str) -> Variable | None:
        """By its name as it is written, or as it is but for capitals where that is one."""
        if name in self.variables:
            return self.variables[name]
        near = [v for v in self.order if v.name.lower() == name.lower()]
        return near[0] if len(near) == 1 else None

    def library(self, identifier: str) -> str:
        """Where the library of this platform is in the file."""
        from platform import machine

        system = SYSTEMS.get(sys.platform)
        processor = PROCESSORS.get(machine().lower())
        if system is None or processor is None:
            raise FmuError(f"FMI has no name for this platform, {sys.platform} {machine()}")
        folder = f"{processor}-{system[0]}"
        if self.version == 2:
            folder = f"{system[1]}64" if processor == "x86_64" else f"{processor}-{system[0]}"
        return f"binaries/{folder}/{identifier}{system[2]}"


def _number(element: Any, key: str) -> float | None:
    try:
        return None if element is None else float(element.get(key))
    except (TypeError, ValueError):
        return None


class Unpacked:
    """The file's content in a folder of its own, which goes with this object, or with the process that made it."""

    def __init__(self, path: str) -> None:
        import weakref
        from tempfile import mkdtemp

        try:
            with zipfile.ZipFile(path) as file:
                names = file.namelist()
                # (what is unpacked of an entry is what its head says, or an error: zipfile reads no further)
                size = sum(entry.file_size for entry in file.infolist())
                largest = (
                    2**31
                )  # [bytes]: half of what 32 bits address, more than libraries and data of a model come to
                if size > largest:
                    raise FmuError(
                        f"{path} comes to {size / 2**30:.1f} GiB unpacked, more than {largest // 2**30}: it is not unpacked",
                        "an FMU holds libraries and data of a model; take out what it does not need",
                    )
                if "modelDescription.xml" not in names:
                    raise FmuError(f"{path} has no modelDescription.xml in it: it is no FMU")
                self.described = Described(file.read("modelDescription.xml"), path)
                self.folder = mkdtemp(prefix="emsim-fmu-")
                weakref.finalize(self, _remove, self.folder, os.getpid())
                if "multiprocessing.util" in sys.modules:  # a worker ends without the interpreter's own end
                    from multiprocessing.util import Finalize

                    Finalize(self, _remove, (self.folder, os.getpid()), exitpriority=0)
                file.extractall(self.folder)
        except (zipfile.BadZipFile, zlib.error, EOFError, RuntimeError, NotImplementedError) as error:
            raise FmuError(f"{path} is no FMU: {error}") from None
        self.content = [os.path.join(at, f) for at, _, files in os.walk(self.folder) for f in files]
        self.folders = [at for at, _, _ in os.walk(self.folder, topdown=False)]


def _remove(folder: str, owner: int) -> None:
    """A child of the process that made it has no right to it."""
    if os.getpid() == owner:
        from shutil import rmtree

        rmtree(folder, ignore_errors=True)
