"""Digital parts under random stimuli, event for event as in ngspice: times, levels and strengths."""

from __future__ import annotations

import random
import re
import subprocess

import pytest
from support import needs_ngspice

import emsim

pytestmark = [needs_ngspice, pytest.mark.ngspice]

KNOWN, ANY = ("0s", "1s"), ("0s", "1s", "Us")
FLIP = "clk_delay=1n set_delay=2n reset_delay=3n ic=1 rise_delay=1n fall_delay=2n"
LATCH = "enable_delay=1n set_delay=2n reset_delay=3n ic=1 rise_delay=1n fall_delay=2n"
GATE = "rise_delay=3n fall_delay=2n"
# name: nodes of the source, lines, nodes that are looked at, states of the source
PARTS = {
    **{
        kind: ("a b c", f"A1 [a b ~c] o m\n.model m {kind}({GATE})", "o", ANY)
        for kind in ("d_and", "d_nand", "d_or", "d_nor", "d_xor", "d_xnor")
    },
    **{kind: ("a", f"A1 a o m\n.model m {kind}({GATE})", "o", ANY) for kind in ("d_buffer", "d_inverter")},
    **{kind: ("a", f"A1 a o m\n.model m {kind}(open_delay=3n)", "o", ANY) for kind in ("d_open_c", "d_open_e")},
    "d_tristate": (
        "a e b f", "A1 a e o t\nA2 b f o t\nA3 o p\n.model t d_tristate(delay=3n)\n.model p d_pullup", "o", ANY
    ),
    "resolution": ("a e b f", "A1 a e o t\nA2 b f o t\n.model t d_tristate(delay=3n)", "o", ANY),
    "slow_rise": ("a", "A1 a o m\n.model m d_buffer(rise_delay=12n fall_delay=3n)", "o", ANY),
    "slow_fall": ("a", "A1 a o m\n.model m d_buffer(rise_delay=3n fall_delay=12n)", "o", ANY),
    "d_dff": ("d c s r", f"A1 d c s r q n m\n.model m d_dff({FLIP})", "q n", ANY),
    "d_jkff": ("j k c s r", f"A1 j k c s r q n m\n.model m d_jkff({FLIP})", "q n", ANY),
    "d_tff": ("t c s r", f"A1 t c s r q n m\n.model m d_tff({FLIP})", "q n", ANY),
    "d_srff": ("a b c s r", f"A1 a b c s r q n m\n.model m d_srff({FLIP})", "q n", ANY),
    "d_dlatch": ("d e s r", f"A1 d e s r q n m\n.model m d_dlatch(data_delay=4n {LATCH})", "q n", ANY),
    "d_srlatch": ("a b e s r", f"A1 a b e s r q n m\n.model m d_srlatch(sr_delay=4n {LATCH})", "q n", KNOWN),
    "d_fdiv": ("c", "A1 c q m\n.model m d_fdiv(div_factor=5 high_cycles=3 i_count=2)", "q", ANY),
    "d_ram": (
        "a b x y w z", "A1 [a b] [p q] [x y] w [z] m\n.model m d_ram(select_value=1 ic=0 read_delay=3n)", "p q", KNOWN
    ),
    "d_lut": ("a b c", 'A1 [a b c] o m\n.model m d_lut(rise_delay=3n fall_delay=2n table_values="01101000")', "o", ANY),
    "open_pins": ("d c", "A1 d c null null q null m\n.model m d_dff", "q", ANY),
}  # fmt: skip

Rows = list[tuple[float, tuple[str, ...]]]


def tidy(rows: Rows) -> Rows:
    """The last of each time, where something differs from the time before."""
    last: Rows = []
    for t, states in rows:
        states = tuple("Uz" if state[1] == "z" else state for state in states)  # nothing drives the level
        if last and t - last[-1][0] < 1e-14:
            last.pop()
        last.append((t, states))
    return [row for k, row in enumerate(last) if k == 0 or row[1] != last[k - 1][1]]


def in_ngspice(folder, deck: str, nodes: list[str]) -> Rows:
    text = deck.replace("\n.end\n", f"\n.control\nrun\neprint {' '.join(nodes)}\n.endc\n.end\n")
    (folder / "ng.cir").write_text(text)
    done = subprocess.run(["ngspice", "-b", "ng.cir"], cwd=folder, capture_output=True, text=True, timeout=60)
    words = [line.split() for line in done.stdout.splitlines()]
    rows = [w for w in words if len(w) == len(nodes) + 1 and re.fullmatch(r"\d\.\d+e[+-]\d+", w[0])]
    assert rows, done.stdout + done.stderr
    return tidy([(float(w[0]), tuple(w[1:])) for w in rows])


def in_emsim(folder, deck: str, nodes: list[str]) -> Rows:
    (folder / "em.cir").write_text(deck)
    now: dict[str, str] = {}
    rows: Rows = []
    for t, node, state in emsim.run(str(folder / "em.cir")).table("tran").digital:
        if node in nodes:
            now[node] = state
            if len(now) == len(nodes):
                rows.append((t, tuple(now[node] for node in nodes)))
    return tidy(rows)


# a memory that is deselected while it is written, both at once, goes on driving in ngspice
CASES = [(name, together) for name in PARTS for together in (1, 3) if (name, together) != ("d_ram", 3)]


@pytest.mark.parametrize(("name", "together"), CASES)
def test_events_are_those_of_ngspice(tmp_path, name, together):
    inputs, lines, outputs, alphabet = PARTS[name]
    draw, count, step = random.Random(name), 300, 4 if name.startswith("slow") else 10
    states = [draw.choice(KNOWN) for _ in inputs.split()]
    table = ["0 " + " ".join(states)]
    for k in range(1, count):
        for _ in range(draw.randint(1, together)):
            states[draw.randrange(len(states))] = draw.choice(alphabet)
        table.append(f"{k * step}n " + " ".join(states))
    (tmp_path / "stimuli.txt").write_text("\n".join(table) + "\n")
    deck = (
        f'random stimuli\nA99 [{inputs}] source\n.model source d_source(input_file="stimuli.txt")\n{lines}\n'
        f"V1 v 0 1\nR1 v 0 1k\n.tran {step}n {count * step}n\n.end\n"
    )
    nodes = [*inputs.split(), *outputs.split()]
    ours, theirs = in_emsim(tmp_path, deck, nodes), in_ngspice(tmp_path, deck, nodes)
    assert [states for _, states in ours] == [states for _, states in theirs]
    assert [t for t, _ in ours] == pytest.approx([t for t, _ in theirs], rel=1e-8, abs=1e-13)


def test_a_state_machine_goes_as_in_ngspice(tmp_path):
    """Up and down through four states, with an output for each."""
    (tmp_path / "machine.txt").write_text(
        "* state outputs inputs next\n0 0s 0s 0 -> 1\n        1 -> 3\n1 0s 1z 0 -> 2\n        1 -> 0\n2 1s 0s 0 -> 3\n"
        "        1 -> 1\n3 1s 1r 0 -> 0\n        1 -> 2\n"
    )
    draw = random.Random(1)
    rows = [f"{10 * k}n {k % 2}s {draw.randint(0, 1)}s {int(draw.random() < 0.1)}s" for k in range(200)]
    (tmp_path / "stimuli.txt").write_text("\n".join(rows) + "\n")
    deck = (
        't\nA9 [c i r] source\n.model source d_source(input_file="stimuli.txt")\nA1 [i] c r [p q] m\n'
        '.model m d_state(clk_delay=2n reset_delay=3n state_file="machine.txt" reset_state=2)\nV1 v 0 1\nR1 v 0 1k\n'
        ".tran 10n 2u\n.end\n"
    )
    ours, theirs = (run(tmp_path, deck, ["c", "i", "r", "p", "q"]) for run in (in_emsim, in_ngspice))
    assert [states for _, states in ours] == [states for _, states in theirs]
    assert [t for t, _ in ours] == pytest.approx([t for t, _ in theirs], rel=1e-8, abs=1e-13)
