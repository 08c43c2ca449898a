"""FMUs for tests, built from part.c by the machine's C compiler."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path
from platform import machine
from shutil import which

SOURCE = Path(__file__).with_name("part.c")
NUMBERS = "time x der(x) v der(v) u g k d s rise every e".split()
FLOAT, WHOLE = ("Real", "Integer"), ("Float64", "Int32")


def library(folder: Path, version: int) -> Path:
    """The compiled part."""
    made = folder / f"part{version}.so"
    if not made.exists():
        compiler = which("cc") or which("gcc") or which("clang")
        assert compiler is not None, "these tests need a C compiler, as the engine's own build does"
        command = [
            compiler,
            "-shared",
            "-fPIC",
            "-O1",
            f"-DFMI={version}",
            str(SOURCE),
            "-o",
            str(made),
            "-lm",
        ]
        subprocess.run(command, check=True, capture_output=True)
    return made


def variables(version: int) -> list[tuple[str, str, dict[str, str]]]:
    """Name, type, attributes, in the order of their value references."""
    real, whole = FLOAT if version == 2 else WHOLE
    causes = {
        "time": "independent",
        "u": "input",
        "x": "output",
        "v": "output",
        "der(x)": "local",
        "der(v)": "local",
        "s": "local",
    }
    starts = {
        "x": "1",
        "v": "0",
        "u": "0",
        "g": "0",
        "k": "4",
        "d": "0",
        "rise": "0",
        "every": "0",
        "e": "0.8",
    }
    found = []
    for name in NUMBERS:
        more = {"causality": causes.get(name, "parameter")}
        if name == "time" and version == 2:
            more["variability"] = "continuous"
        if name in starts:
            more["start"] = starts[name]
            more["initial"] = "exact"
        if name == "u":
            del more["initial"]
        if more["causality"] == "parameter":
            more["variability"] = "fixed"
        if name.startswith("der"):
            of = name[4]
            more["derivative"] = str(NUMBERS.index(of) + (1 if version == 2 else 0))
        found.append((name, real, more))
    found.append(("hits", whole, {"causality": "output", "variability": "discrete"}))
    fixed = {"causality": "parameter", "variability": "fixed", "initial": "exact"}
    found.append(("fault", whole, {**fixed, "start": "0"}))
    found.append(("word", "String", {**fixed, "start": ""}))
    found.append(("the energy", real, {"causality": "output"}))
    return found


def description(version: int, can: str, kinds: str) -> str:
    attributes = f'modelIdentifier="part" {can}'
    heads = [f"<{kind} {attributes}/>" for kind in kinds.split()]
    rows = []
    for k, (name, kind, more) in enumerate(variables(version)):
        start = more.pop("start", None) if version == 2 or kind == "String" else more.get("start")
        derivative = more.pop("derivative", None) if version == 2 else more.get("derivative")
        words = " ".join(f'{key}="{value}"' for key, value in more.items())
        if version == 2:
            inner = "".join(
                f' {key}="{value}"'
                for key, value in (("start", start), ("derivative", derivative))
                if value is not None
            )
            rows.append(
                f'<ScalarVariable name="{name}" valueReference="{k}" {words}><{kind}{inner}/></ScalarVariable>'
            )
        elif kind == "String":
            rows.append(
                f'<String name="{name}" valueReference="{k}" {words}><Start value="{start}"/></String>'
            )
        else:
            rows.append(f'<{kind} name="{name}" valueReference="{k}" {words}/>')
    if version == 2:
        head = 'fmiVersion="2.0" guid="{part}" numberOfEventIndicators="1"'
        structure = '<Derivatives><Unknown index="3"/><Unknown index="5"/></Derivatives>'
    else:
        head = 'fmiVersion="3.0" instantiationToken="{part}"'
        structure = (
            '<ContinuousStateDerivative valueReference="2"/><ContinuousStateDerivative valueReference="4"/>'
        )
        structure += '<EventIndicator valueReference="1"/>'
    return (
        f'<fmiModelDescription {head} modelName="part">{"".join(heads)}<ModelVariables>{"".join(rows)}</ModelVariables>'
        f"<ModelStructure>{structure}</ModelStructure></fmiModelDescription>"
    )


def part(
    folder: Path,
    version: int,
    can: str | None = None,
    kinds: str = "ModelExchange CoSimulation",
    platform: str = "",
) -> str:
    """An FMU of the part; `can`: attributes of what it can."""
    if can is None:
        word = "canGetAndSetFMUstate" if version == 2 else "canGetAndSetFMUState"
        directional = "providesDirectionalDerivative" + ("s" if version == 3 else "")
        can = f'{word}="true" {directional}="true"'
    system = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib")}[sys.platform]
    processor = {"arm64": "aarch64"}.get(machine(), machine())
    place = f"{system[0]}64" if version == 2 else f"{processor}-{system[0]}"
    path = folder / f"part{version}.fmu"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("modelDescription.xml", description(version, can, kinds))
        file.write(library(folder, version), f"binaries/{platform or place}/part{system[1]}")
        file.writestr("resources/readme.txt", "nothing")
    return str(path)
