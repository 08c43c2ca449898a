"""Sections of .control made at random by their grammar: analyses, vectors, functions, blocks, files, alterations, mostly such as
people write, some of them broken on purpose. None may end in an internal error, hang, or write a file outside of its folder.

    python tests/stability/control_programs.py [--seed N] [--count N] [--minutes N]

runs them one after the other in one process and prints the programs that did one of these.
"""

from __future__ import annotations

import argparse
import os
import random
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import emsim
from emsim import pipeline
from emsim.control import COMMANDS, Section
from emsim.elaborate.altered import Altered
from emsim.result import Result

LIMIT = 200  # commands of a program
LONGEST = 1e4  # rows of a transient
SLOW = 60.0  # s: a program that takes longer hangs

RC = "V1 in 0 DC 1 AC 1 SIN(0 1 1k)\nR1 in out {r}\nC1 out 0 100n\n.param r=1k\n"
DECKS = {
    "rc": RC + ".tran 20u 1m\n",
    "several": RC
    + "D1 out 0 dm\n.model dm d(is=1e-14)\n.op\n.ac dec 3 10 10k\n.dc v1 0 1 0.25\n.tran 50u 1m\n",
    "steps": RC + ".step param r list 1k 2k\n.tran 50u 1m\n.meas tran top max v(out)\n",
    "machine": "V1 a 0 1\nMOTOR m a 0 hinge r=1 l=1m kt=0.1\n.gravity 9.81\nBODY arm m=0.1 com=(0.1,0)\n"
    "JOINT hinge 0 arm pin damp=1m\nR1 a out 1k\nR2 out 0 {r}\n.param r=1k\n.tran 5m 50m\n",
    "digital": "V1 in 0 PULSE(0 1 0 1n 1n 50u 100u)\nA1 [in] [d] ad\nA2 d e inv\nA3 [d e] [x y] da\n.model ad adc_bridge\n"
    ".model inv d_inverter\n.model da dac_bridge\nR1 x out {r}\nR2 y out 1k\nR3 out 0 1k\n.param r=1k\n.tran 5u 200u\n",
}

NAMES = "v(out) v(in) out in i(v1) v1#branch time frequency a b c k all op1.v(out) tran1.out ac1.v(out) @r1[i]".split()
NAMES += ["@r1[resistance]"]
NAMES += "const.pi pi e c angle(hinge) omega(hinge) v(d) d x y sweep nobody r".split()
FUNCTIONS = """mag magnitude abs ph phase cph cphase unwrap j real re imag im conj pos db log ln log10 exp sqrt sin cos tan atan
asin acos sinh cosh tanh floor ceil nint deg rpm length mean avg integ deriv group_delay interpolate stddev norm sortorder vecmin
vecmax minimum maximum rms vector cvector unitvec rnd sunif sgauss poisson exponential f g""".split()
NUMBERS = "0 1 2 3 -1 10 1k 1m 2.5 1e-9 1e6 1meg 0.1 5u 1e300 -0 7".split()
OPERATORS = "+ - * / % ^ , = <> > < >= <= eq ne gt lt ge le and or & |".split()
ANALYSES = [
    "op",
    "tran 20u 0.5m",
    "tran 1u 50u uic",
    "tran 10u 1m 0.2m",
    "ac dec 3 10 10k",
    "ac lin 5 1 1k",
    "dc v1 0 1 0.5",
    "dc v1 0 1 0.5 r1 1k 2k 1k",
    "noise v(out) v1 dec 3 10 1k",
    "tf v(out) v1",
    "pz in 0 out 0 vol pz",
    "sens v(out)",
    "sens v(out) ac dec 2 10 1k",
    "disto dec 2 10 1k",
    "tran 20u",
    "ac dec 3 10",
    "dc nobody 0 1 1",
    "run",
    "run",
    "tran 0 0",
    "ss 20u 1m",
    "pss 1k 1m out",
]
VARIABLES = "k units numdgt filetype appendwrite width specwindow wr_vecnames list dpolydegree polydegree temp reltol".split()
VARIABLES += "fourgridsize nfreqs".split()
VALUES = [
    "",
    " = 3",
    " = degrees",
    " = ascii",
    " = ( 1 2 3 )",
    " = 1e-4",
    " = hanning",
    " = -1",
    ' = "a b"',
    " = 0",
]
WORDS = "title hello 1k r1 v(out) $k $&a $&k $nobody {a} a=b".split()


class Maker:
    """Programs of one seed."""

    def __init__(self, seed: int) -> None:
        self.r = random.Random(seed)
        self.commands: dict[str, Callable[[], str]] = {
            "analysis": lambda: self.r.choice(ANALYSES),
            "let": lambda: f"let {self.target()} = {self.expression(3)}",
            "print": lambda: f"print {self.some()}",
            "echo": lambda: "echo " + " ".join(self.pick(WORDS) for _ in range(self.r.randint(0, 5))),
            "set": lambda: f"set {self.pick(VARIABLES)}{self.pick(VALUES)}",
            "unset": lambda: f"unset {self.pick(['k', 'units', 'nobody', 'list'])}",
            "meas": lambda: self.measurement(),
            "alter": lambda: self.pick(
                [
                    "alter r1 = {}",
                    "alter @r1[resistance] = {}",
                    "alter v1 dc = {}",
                    "alter @v1[sin] = [ 0 {} 1k ]",
                    "alter nobody = {}",
                    "altermod dm is = {}",
                    "alterparam r = {}",
                    "alter c1 {}",
                    "alter @m1[r] = {}",
                ]
            ).format(self.pick([*NUMBERS, "$k", "$&a", "a", "{r*2}"])),
            "reset": lambda: self.pick(
                [
                    "reset",
                    "remcirc",
                    "destroy all",
                    "destroy tran1",
                    "destroy",
                    "setplot tran1",
                    "setplot new",
                    "setplot previous",
                    "setplot nobody",
                    "setplot const",
                ]
            ),
            "show": lambda: self.pick(
                [
                    "show",
                    "show r1",
                    "show all",
                    "showmod",
                    "display",
                    "listing",
                    "rusage all",
                    "version",
                    "show r1 : i",
                    "setplot",
                    "edisplay",
                    "eprint d",
                    "unlet a b",
                ]
            ),
            "arrays": lambda: self.pick(
                [
                    "compose a values 1 2 3",
                    "compose b start=0 stop=1 step=0.1",
                    "compose c lin=5 start=1 stop=2",
                    "cross a 1 out in",
                    "reshape a [2][2]",
                    "reshape a b",
                    "transpose a",
                    "diff tran1 tran2",
                    "settype voltage a",
                    "setscale a",
                    "setscale out",
                    "compose a start=0 stop=1 step=0",
                    "reshape out [3][]",
                    "linearize",
                    "linearize v(out)",
                    "fft v(out)",
                    "fft a",
                    "psd 3 v(out)",
                    "spec 0 10k 500 v(out)",
                    "fourier 1k v(out)",
                    "four 1k a",
                ]
            ),
            "files": lambda: self.pick(
                [
                    "write x.raw",
                    "write x.raw v(out) a",
                    "wrdata x.txt v(out)",
                    "wrdata x v(out) a b",
                    "load x.raw",
                    "source x.txt",
                    "write ../x.raw",
                    "wrdata /tmp/emsim_programs_outside v(out)",
                    "load nobody.raw",
                    "write",
                    "wrdata x",
                    "eprvcd d > x.vcd",
                    "wrdata sub/x v(out)",
                ]
            ),
            "functions": lambda: self.pick(
                [
                    "define f(x) x*2",
                    "define g(x,y) x+y*f(x)",
                    "define f(x) f(x)+1",
                    "undefine f",
                    "undefine nobody",
                    "define",
                    "define f",
                    "define f(x,x) x",
                    "strcmp k a b",
                    "shift list",
                    "shift list 2",
                    "setseed 3",
                    "setseed",
                    "alias p print v(out)",
                    "alias",
                    "unalias p",
                    "p",
                    "save v(out)",
                    "save all",
                    "save @r1[i]",
                    "option reltol=1e-4",
                    "option method=gear",
                    "option nobody=1",
                    "quit 3",
                    "shell ls",
                    "stop",
                    "stop when time = 0.5m",
                    "stop when time > 30u when v(out) > 0.1",
                    "stop when v(out) = v(in)",
                    "stop when out < 2",
                    "stop when nobody > 1",
                    "status",
                    "delete 1",
                    "delete all",
                    "step",
                    "step 3",
                    "resume",
                ]
            ),
        }
        self.weights = {"analysis": 6, "let": 9, "print": 6, "set": 2, "meas": 2, "alter": 2, "arrays": 3}

    def pick(self, words: list[str]) -> str:
        return self.r.choice(words)

    def target(self) -> str:
        return self.pick(
            [
                "a",
                "b",
                "c",
                "k",
                "a[1]",
                "a[0,2]",
                "out",
                "time",
                "tran1.z",
                "const.q",
                "b[0][1]",
                "nobody[2]",
            ]
        )

    def some(self) -> str:
        return " ".join(self.expression(2) for _ in range(self.r.randint(1, 3)))

    def expression(self, depth: int) -> str:
        r = self.r
        if depth == 0 or r.random() < 0.25:
            return self.pick(NAMES) if r.random() < 0.7 else self.pick(NUMBERS)
        kind = r.randrange(9)
        one = self.expression(depth - 1)
        if kind < 2:
            return f"{self.pick(FUNCTIONS)}({one})"
        if kind < 5:
            return f"{one} {self.pick(OPERATORS)} {self.expression(depth - 1)}"
        if kind == 5:
            return f"({one})"
        if kind == 6:
            return f"{one}[{self.pick(['0', '1', '0,3', '-1', '99', '[1m,2m]', 'k', '1][0', '', 'length(a)-1'])}]"
        if kind == 7:
            return f"{self.pick(['-', 'not ', '~'])}{one}"
        return f"({one} ? {self.expression(depth - 1)} : {self.expression(depth - 1)})"

    def measurement(self) -> str:
        signal = self.pick(["v(out)", "v(in)", "i(v1)", "vdb(out)", "a", "nobody"])
        what = self.pick(
            [
                "max {0}",
                "min {0} from=0.1m to=0.5m",
                "avg {0}",
                "rms {0}",
                "pp {0}",
                "integ {0}",
                "when {0}=0.1 rise=1",
                "when {0}=0.1 cross=last",
                "find v(in) when {0}=0.2",
                "find {0} at=0.3m",
                "deriv {0} at=0.2m",
                "trig {0} val=0.1 rise=1 targ {0} val=0.2 fall=1",
                "param='2*a'",
                "max_at {0}",
                "trig at=0 targ {0} val=0.2 cross=2 td=0.1m",
                "find",
                "when",
                "max",
            ]
        ).format(signal)
        return (
            f"meas {self.pick(['tran', 'ac', 'dc', 'sp', 'op', ''])} {self.pick(['q', 'a', 'v(out)'])} {what}"
        )

    def line(self) -> str:
        text = self.commands[
            self.r.choices([*self.commands], [self.weights.get(c, 1) for c in self.commands])[0]
        ]()
        if self.r.random() < 0.06:  # broken: a word less, twice, or in another place
            words = text.split(" ")
            at = self.r.randrange(len(words))
            words[at : at + 1] = self.pick(
                [[], [words[at]] * 2, [words[at][:-1]], [words[at] + "("], ["$" + words[at]]]
            )  # type: ignore[arg-type]
            text = " ".join(words)
        return text

    def block(self, depth: int) -> list[str]:
        lines: list[str] = []
        for _ in range(self.r.randint(1, 5)):
            if depth and self.r.random() < 0.15:
                inner = self.block(depth - 1)
                head = self.pick(
                    [
                        "if {}",
                        "while {}",
                        "dowhile {}",
                        "repeat 2",
                        "foreach k 1 2 3",
                        "foreach k $list",
                        "repeat {}",
                        "repeat",
                        "foreach",
                    ]
                ).format(self.expression(2))
                lines += [head, *inner]
                if head.startswith("if") and self.r.random() < 0.4:
                    lines += ["else", *self.block(depth - 1)]
                if self.r.random() < 0.2:
                    lines.append(self.pick(["break", "continue", "break 2", "goto top"]))
                lines.append("end")
            else:
                lines.append(self.line())
        return lines

    def program(self) -> tuple[str, str]:
        """Name of the deck, commands."""
        # most leave the deck as it is: their analyses are those of others
        self.weights["alter"] = 2 if self.r.random() < 0.1 else 0
        lines = self.block(3)
        if self.r.random() < 0.05:
            lines.insert(0, "label top")
        if self.r.random() < 0.002:
            lines.append(
                self.pick(
                    ["plot v(out)", "hardcopy x.png v(out)", "plot a vs b", "gnuplot y v(out) xlimit 0 1m"]
                )
            )
        return self.pick([*DECKS]), "\n".join(lines)


def programs(seed: int) -> Iterator[tuple[str, str]]:
    maker = Maker(seed)
    while True:
        yield maker.program()


class Runner:
    """Runs programs; what analyses of decks that nothing has altered give is kept."""

    def __init__(self) -> None:
        self.kept: dict[tuple[str, str], Result] = {}

    def run(self, name: str, commands: str) -> None:
        """Raises whatever is none of emsim's own errors."""
        deck = pipeline.load(f"t\n{DECKS[name]}.control\n{commands}\n.endc\n.end\n")
        try:
            flat = pipeline.flatten(deck)
        except emsim.DeckError:
            return
        altered = Altered(deck, flat)

        def analyse(flat, cards) -> Result:
            plain = not (altered._changes or altered.options or deck.defines)
            asked = " ".join(p.text for p in (*flat.wanted, *altered.saves))
            steps = " ".join(f"{step.column} {value}" for step, value in altered._steps)
            key = (
                name,
                " ".join(f"{c.kind} {c.args} {sorted(c.flags)}" for c in cards) + f"; {asked}; {steps}",
            )
            if plain and key in self.kept:
                return self.kept[key]
            for card in cards:
                times = [a for a in card.args if isinstance(a, float)]
                if (
                    card.kind in ("tran", "ss")
                    and len(times) > 1
                    and times[0] > 0
                    and times[1] / times[0] > LONGEST
                ):
                    raise emsim.DeckError([])  # a word that was broken has made a run of hours of it
            flat.analyses = cards
            assembly, planned = pipeline.prepare(flat, altered.options)
            result = pipeline.deliver(assembly, pipeline.solve(assembly, planned))
            if plain and len(self.kept) < 5000:
                self.kept[key] = result
            return result

        session = Section(COMMANDS, altered, analyse, lambda text: None, most=LIMIT)
        try:
            session.run(flat.commands)
        except (emsim.DeckError, emsim.ConvergenceError, emsim.OutsideError):
            return
        for table in session.tables():
            assert all(len(table[column]) == len(table) for column in table.names)


def wrong(runner: Runner, name: str, commands: str) -> str:
    """What is wrong with the run of a program, "" where nothing is."""
    outside = Path("/tmp/emsim_programs_outside")
    above = set(os.listdir(".."))
    start = time.monotonic()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            runner.run(name, commands)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException:  # a panic of the engine is no Exception
        return traceback.format_exc(limit=-6)
    if time.monotonic() - start > SLOW:
        return f"it took {time.monotonic() - start:.0f} s"
    if outside.exists() or set(os.listdir("..")) != above:
        return "it has written outside of its folder"
    return ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=1_000_000)
    parser.add_argument("--minutes", type=float, default=10.0)
    given = parser.parse_args()
    began, found, seen = time.monotonic(), 0, set()
    with tempfile.TemporaryDirectory() as folder:
        inner = Path(folder) / "inner"
        inner.mkdir()
        os.chdir(inner)
        runner = Runner()
        for k, (name, commands) in enumerate(programs(given.seed)):
            if k >= given.count or time.monotonic() - began > 60.0 * given.minutes:
                break
            said = wrong(runner, name, commands)
            key = said.splitlines()[-1:] and said.splitlines()[-1]
            if said and key not in seen:
                seen.add(key)
                found += 1
                print(
                    f"---- program {k} of seed {given.seed}, deck {name}\n{commands}\n---- {said}", flush=True
                )
        os.chdir("/")
    print(f"{k} programs in {time.monotonic() - began:.0f} s, {found} things wrong")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
