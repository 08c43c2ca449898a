"""The library of an FMU: the engine, with the functions of FMI, for programs without Python.

The module of Python has them too (engine/src/fmi). In an ELF file (Linux) it becomes a library of its own when its references
to Python's symbols are made weak: a weak reference that nobody answers is 0 rather than an error, and nothing on the way of
FMI's functions uses one. So a wheel holds one engine, not two. Other formats know no such thing; there the library is built
without Python, and given by its path:

    cargo build --release --no-default-features --manifest-path emsim/engine/Cargo.toml
    emsim fmu deck.cir --library target/release/_engine.dll
"""

from __future__ import annotations

import struct

from ..diagnostics import Diagnostic, OutsideError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import NoReturn

# what a library is for: folder in FMI 3, in FMI 2, ending
PLATFORMS = {
    ("elf", 0x3E): ("x86_64-linux", "linux64", ".so"),
    ("elf", 0xB7): ("aarch64-linux", "", ".so"),
    ("pe", 0x8664): ("x86_64-windows", "win64", ".dll"),
    ("pe", 0xAA64): ("aarch64-windows", "", ".dll"),
    ("mach-o", 0x01000007): ("x86_64-darwin", "darwin64", ".dylib"),
    ("mach-o", 0x0100000C): ("aarch64-darwin", "", ".dylib"),
}
ENTRY = {2: b"fmi2Instantiate", 3: b"fmi3InstantiateCoSimulation"}
BUILD = "cargo build --release --no-default-features --manifest-path emsim/engine/Cargo.toml makes one; --library names it"
PYTHON = (b"Py", b"_Py")
WEAK, DYNSYM = 2, 11


def binaries(paths: Sequence[str], version: int) -> list[tuple[str, str, bytes]]:
    """(folder below binaries/, ending, content) of these libraries, or of this platform's own. Raises OutsideError (E514)."""
    return [_placed(path, data, version) for path, data in _contents(paths)]


def _contents(paths: Sequence[str]) -> Iterator[tuple[str, bytes]]:
    for path in paths:
        try:
            with open(path, "rb") as file:
                yield path, file.read()
        except OSError as error:
            _refuse(f"cannot read the library {path}: {error.strerror}")
    if not paths:
        from .._engine import __file__ as own

        path = str(own)
        with open(path, "rb") as file:
            data = file.read()
        if data[:4] != b"\x7fELF":
            from platform import machine, system

            said = f"an FMU for {system()} {machine()} needs a library that was built for it: the engine of Python is none there"
            _refuse(said, BUILD)
        yield path, without_python(data)


def _placed(path: str, data: bytes, version: int) -> tuple[str, str, bytes]:
    found = PLATFORMS.get(format_of(data) or ("", 0))
    if found is None or ENTRY[version] not in data:
        _refuse(
            f"{path} is no library of FMI {version} functions for a platform that FMI has a name for", BUILD
        )
    three, two, ending = found
    if version == 2 and not two:
        _refuse(f"FMI 2.0 has no name for {three}", "FMI 3.0 has: --fmi 3")
    return (three if version == 3 else two), ending, data


def format_of(data: bytes) -> tuple[str, int] | None:
    """Format of a library and the processor that it is for."""
    if data[:4] == b"\x7fELF":
        return "elf", struct.unpack_from("<H", data, 18)[0]
    if data[:2] == b"MZ":
        at = struct.unpack_from("<I", data, 0x3C)[0]
        return "pe", struct.unpack_from("<H", data, at + 4)[0]
    if data[:4] == b"\xcf\xfa\xed\xfe":
        return "mach-o", struct.unpack_from("<I", data, 4)[0]
    return None


def without_python(data: bytes) -> bytes:
    """An ELF library (64 bits, little endian) whose open references to Python are weak. (System V ABI, chapter 4: section
    headers, string table, symbol table.)"""
    out = bytearray(data)
    start, size, count = struct.unpack_from("<Q", data, 0x28)[0], *struct.unpack_from("<HH", data, 0x3A)
    sections = [struct.unpack_from("<IIQQQQIIQQ", data, start + k * size) for k in range(count)]
    tables = [s for s in sections if s[1] == DYNSYM]
    if not tables:
        _refuse("the engine's library has no table of symbols: an FMU cannot be made of it", BUILD)
    for _, _, _, _, at, length, link, _, _, entry in tables:
        names = sections[link][4]
        for k in range(at, at + length, entry):
            name, info, _, section = struct.unpack_from("<IBBH", data, k)
            if section == 0 and data.startswith(PYTHON, names + name):
                out[k + 4] = (WEAK << 4) | (info & 0xF)
    return bytes(out)


def licences() -> dict[str, bytes]:
    """What goes with the engine wherever it goes."""
    from pathlib import Path

    found: dict[str, bytes] = {}
    beside = Path(__file__).resolve().parent.parent.parent
    is_tree = (beside / "pyproject.toml").exists()
    places = beside.glob("LICENSE-*" if is_tree else "emsim-*.dist-info/licenses/LICENSE-*")
    for path in places:
        found[f"documentation/licenses/emsim-{path.name}.txt"] = path.read_bytes()
    return dict(sorted(found.items()))


def _refuse(said: str, hint: str | None = None) -> NoReturn:
    raise OutsideError(Diagnostic("error", "E514", said, hint=hint))
