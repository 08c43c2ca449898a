"""Cost over size: time and memory of every stage, and the exponent with which each grows.

    python tests/bench/scale.py [--scene chain,ring,ladder,mesh,supply,rectifiers] [--ngspice]
    python tests/bench/scale.py --beside     large circuits in one table, whole processes of emsim and ngspice by turns
    python tests/bench/scale.py --apart      circuits of two paces in one deck, as they are and tied; alike ones one by one

Scenes: a chain of links let go from the horizontal, a ring of links hung up at one of its joints, an RC ladder, a square mesh
of RC, a supply grid whose loads have clocks of their own, rectifiers side by side. CPU seconds, the least of three;
every size in a process of its own, for its memory [MB].
Stages: read (text to flat deck), assemble (flat deck to programs), solve (a transient), point (of it, by the rows that it
recorded; it grows faster where factors leave the caches). The exponent is the slope log(time)/log(size) between the two largest
sizes. With --ngspice the same decks run there, as whole processes. Exit code 1 where read or assemble grow with an exponent
above 1.3.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter, process_time

LIMIT = 1.3
FLOOR = 0.02  # seconds: what is shorter is told and not judged
ROUNDS = 3


def chain(n: int) -> str:
    length = 1.0 / n
    cards = ["a chain", ".gravity 9.81"]
    before = "0"
    for k in range(1, n + 1):
        start = "zero=-90deg ic=90deg" if k == 1 else ""
        cards += [f"BODY b{k} shape=rod({length}) m={length}", f"JOINT p{k} {before} b{k} pin {start}"]
        before = f"b{k}({length},0)"
    return "\n".join([*cards, f".print tran x({before})", f".tran 1m {0.1 / math.sqrt(n)}", ".end", ""])


def ring(n: int) -> str:
    """A closed chain, let go as a regular polygon."""
    length, turn = 3.0 / n, 360.0 / n
    cards = ["a ring", ".gravity 9.81"]
    before = "0"
    for k in range(1, n + 1):
        cards += [
            f"BODY b{k} shape=rod({length}) m={length}",
            f"JOINT p{k} {before} b{k} pin guess={turn!r}deg",
        ]
        before = f"b{k}({length},0)"
    last = f"JOINT last {before} 0 pin"
    return "\n".join(
        [*cards, last, f".print tran y(b{n // 2})", f".tran 1m {0.1 / math.sqrt(n)}", ".end", ""]
    )


def ladder(n: int) -> str:
    cards = ["a ladder", "V1 n0 0 PULSE(0 1 0 1u 1u 1m 2m)"]
    cards += [f"R{k} n{k} n{k + 1} 1\nC{k} n{k + 1} 0 1n" for k in range(n)]
    return "\n".join([*cards, f".print tran v(n{n})", ".tran 10u 1m", ".end", ""])


def mesh(n: int) -> str:
    """n nodes, in a square."""
    side = round(math.sqrt(n))
    cards = ["a mesh", "V1 n0_0 0 PULSE(0 1 0 1u 1u 1m 2m)"]
    for i in range(side):
        for j in range(side):
            cards += [f"Ra{i}_{j} n{i}_{j} n{i + 1}_{j} 100"] if i + 1 < side else []
            cards += [f"Rb{i}_{j} n{i}_{j} n{i}_{j + 1} 100"] if j + 1 < side else []
            cards += [f"C{i}_{j} n{i}_{j} 0 1n"]
    return "\n".join([*cards, f".print tran v(n{side - 1}_{side - 1})", ".tran 10u 1m", ".end", ""])


# delay, width and period of a load [ns]: least, spread, steps of the golden ratio and its kin, which fill it evenly
SPREAD = ((0.0, 4.0, 0.618034), (0.5, 1.0, 0.754878), (3.0, 2.0, 0.569840))


def supply(n: int) -> str:
    """n nodes, in a square, fed through a coil; every fifth has a load that switches in a period of its own."""
    side = round(math.sqrt(n))
    cards = ["a supply grid", "V1 in 0 1.2", "R1 in a 5m", "L1 a n0_0 0.1n"]
    for i in range(side):
        for j in range(side):
            cards += [f"Ra{i}_{j} n{i}_{j} n{i + 1}_{j} 50m"] if i + 1 < side else []
            cards += [f"Rb{i}_{j} n{i}_{j} n{i}_{j + 1} 50m"] if j + 1 < side else []
            cards += [f"C{i}_{j} n{i}_{j} 0 1p"]
            if (k := i * side + j) % 5 == 0:
                late, wide, period = (a + b * (k * c % 1) for a, b, c in SPREAD)
                pulse = f"PULSE(0 1m {late:.3f}n 0.1n 0.1n {wide:.3f}n {period:.3f}n)"
                cards += [f"I{i}_{j} n{i}_{j} 0 {pulse}"]
    return "\n".join([*cards, f".print tran v(n{side - 1}_{side - 1})", ".tran 50p 2n", ".end", ""])


def rectifiers(n: int) -> str:
    cards = ["rectifiers", ".model d D(is=1e-14 rs=0.1 cjo=10p)"]
    for k in range(n):
        cards += [f"V{k} a{k} 0 SIN(0 {5 + k / n:.6g} 1k)", f"D{k} a{k} b{k} d"]
        cards += [f"C{k} b{k} 0 1u", f"R{k} b{k} 0 {1000 + k}"]
    return "\n".join([*cards, ".print tran v(b0)", ".tran 10u 2m", ".end", ""])


SCENES = {
    "chain": (chain, (100, 300, 1000)),
    "ring": (ring, (50, 100, 200)),
    "ladder": (ladder, (5000, 15000, 50000)),
    "mesh": (mesh, (900, 3600, 10000)),
    "supply": (supply, (900, 2500, 4900)),
    "rectifiers": (rectifiers, (100, 300, 1000)),
}


BESIDE = (
    ("rectifiers", 1000),
    ("rectifiers", 10000),
    ("mesh", 40000),
    ("ladder", 50000),
    ("supply", 900),
    ("supply", 2500),
)


def stages(path: str) -> dict[str, float]:
    """CPU seconds of each stage of a deck, points, and the memory of the process [MB]."""
    from emsim.pipeline import flatten, load, prepare, run

    t = process_time()
    flat = flatten(load(path))
    read = process_time() - t
    t = process_time()
    prepare(flat)
    assemble = process_time() - t
    t = process_time()
    result = run(path)
    whole = process_time() - t
    points = len(result.time)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    solve = result.stats["solve_time"]
    return {
        "read": read,
        "assemble": assemble,
        "run": whole,
        "solve": solve,
        "point": solve / points,
        "memory": memory,
    }


def measured(path: Path) -> dict[str, float]:
    """The least of some runs, each in a process of its own."""
    found: list[dict[str, float]] = []
    for _ in range(ROUNDS):
        done = subprocess.run(
            [sys.executable, __file__, "--measure", str(path)], capture_output=True, text=True, check=True
        )
        found.append(json.loads(done.stdout.splitlines()[-1]))
    return {stage: min(f[stage] for f in found) for stage in found[0]}


def spice(path: Path, folder: Path) -> tuple[float, float]:
    """CPU seconds and MB of ngspice on the deck."""
    return used_by(["ngspice", "-b", "-r", str(folder / "ng.raw"), str(path)], folder)


def used_by(command: list[str], folder: Path) -> tuple[float, float]:
    """CPU seconds and MB of a process."""
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder
    ) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{' '.join(command)} ends with {process.returncode}")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


def beside() -> None:
    """Time and memory of large circuits, and how many times those of emsim ngspice takes."""
    print(
        f"{'circuit':20s}{'emsim':>9s}{'ngspice':>11s}{'ratio':>8s}{'emsim':>10s}{'ngspice':>11s}{'ratio':>8s}"
    )
    for scene, size in BESIDE:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            path = folder / f"{scene}.cir"
            path.write_text(SCENES[scene][0](size))
            ours = [sys.executable, "-m", "emsim", "run", str(path), "-o", str(folder / "em.raw")]
            (a, more), (b, less) = used_by(ours, folder), spice(path, folder)
        print(
            f"{scene:12s}{size:8d}{a:8.1f}s{b:10.1f}s{b / a:8.1f}{more:8.0f}MB{less:9.0f}MB{less / more:8.2f}",
            flush=True,
        )


FAST = "VP g 0 PULSE(0 5 0 20n 20n 480n 1u)\nRG g h 1k\nCG h 0 100p\n"
TIE = "RT h b0 1e15\n"


def solve_time(text: str) -> float:
    """Seconds of a whole run; the least of some."""
    import emsim

    def once() -> float:
        start = perf_counter()
        emsim.run(text)
        return perf_counter() - start

    return min(once() for _ in range(ROUNDS))


def apart() -> None:
    """What steps of their own save where paces differ, and what they would cost where they do not."""
    print(
        f"{'rectifiers':>11s}{'alone':>9s}{'pulses':>9s}{'in one deck':>13s}{'tied':>9s}{'one by one':>12s}"
    )
    for n in (30, 100, 300):
        slow = rectifiers(n)
        fast = "pulses\n" + FAST + ".print tran v(h)\n.tran 10u 2m\n.end\n"
        both = slow.replace(".print tran v(b0)", FAST + ".print tran v(b0) v(h)")
        tied = both.replace(".print", TIE + ".print")
        found = [solve_time(text) for text in (slow, fast, both, tied)]
        one = n * solve_time(rectifiers(1))
        print(
            f"{n:11d}{found[0]:8.3f}s{found[1]:8.3f}s{found[2]:12.3f}s{found[3]:8.3f}s{one:11.3f}s",
            flush=True,
        )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default=",".join(SCENES))
    parser.add_argument("--ngspice", action="store_true")
    parser.add_argument("--beside", action="store_true")
    parser.add_argument("--apart", action="store_true")
    parser.add_argument("--measure", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.measure:
        print(json.dumps(stages(asked.measure)))
        return 0
    if asked.beside or asked.apart:
        (beside if asked.beside else apart)()
        return 0
    too_steep = []
    for scene in asked.scene.split(","):
        write, sizes = SCENES[scene]
        rows = []
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for size in sizes:
                path = folder / f"{scene}{size}.cir"
                path.write_text(write(size))
                rows.append(measured(path))
                line = "  ".join(f"{stage} {value:.4g}" for stage, value in rows[-1].items())
                print(f"{scene:11s}{size:7d}  {line}", flush=True)
                if asked.ngspice and scene not in ("chain", "ring") and shutil.which("ngspice"):
                    seconds, memory = spice(path, folder)
                    print(f"{'':18s}  ngspice {seconds:.4g} s  {memory:.4g} MB", flush=True)
        for stage in rows[0]:
            last, one_before = rows[-1][stage], rows[-2][stage]
            exponent = math.log(last / one_before) / math.log(sizes[-1] / sizes[-2])
            judged = stage in ("read", "assemble") and last > FLOOR
            print(f"{scene:11s}{stage:>10s}  exponent {exponent:.2f}")
            if judged and exponent > LIMIT:
                too_steep.append(f"{scene} {stage} {exponent:.2f}")
    print("above 1.3: " + (", ".join(too_steep) or "none"))
    return bool(too_steep)


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    sys.exit(main())
