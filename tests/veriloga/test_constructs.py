"""Constructs of Verilog-A, one small deck each: what runs gives the value that the standard says, what is not there is an error
that names it and points at it. The guide's table (guide/device.md) tells the same."""

from __future__ import annotations

from math import log10
from pathlib import Path

import pytest
from module_decks import HEAD

import emsim

R = "module r(a, b); inout a, b; electrical a, b; parameter real r = 1; analog V(a, b) <+ r * I(a, b); endmodule\n"


def plain(body: str, declared: str = "", before: str = "") -> str:
    return f"{before}module m(in, out); inout in, out; electrical in, out; {declared}\nanalog begin {body} end\nendmodule\n"


def of(text: str, before: str = R) -> str:
    return f"{before}module m(in, out); inout in, out; electrical in, out; {text} endmodule\n"


OP = "V1 in 0 0.5"
RAMP = "V1 in 0 pwl(0 0 1 1)"
# name: module, what runs, v(out) at the end; V1 gives 0.5 V, or ramps up to 1 V in 1 s; 1 kohm lies at the output
AT_REST: dict[str, tuple[str, float]] = {
    "macro with a default argument": (plain("V(out) <+ `f(2);", before="`define f(a, b=3) ((a) * (b))\n"), 6),
    "attributes before and behind": (
        of('(* desc="a" *) parameter real r = 1 (* units="V" *) from (0:inf) (* type="instance" *); analog V(out) <+ r;'), 1),
    "attributes of ports": (
        "module m((* a=1 *) in, out (* b *)); inout in, out; electrical in, out; analog V(out) <+ 1; endmodule\n", 1),
    "ANSI ports": ("module m(inout electrical in, inout electrical out); analog V(out) <+ V(in); endmodule\n", 0.5),
    "input and output": ("module m(in, out); input in; output out; electrical in, out; analog V(out) <+ V(in); endmodule\n", 0.5),
    "row of nodes and genvar": (
        of("electrical [0:4] n; genvar i; analog begin V(n[0]) <+ 0; for (i = 0; i < 4; i = i + 1) V(n[i + 1], n[i]) <+ 0.1;"
           " V(out) <+ V(n[4]); end"), 0.4),
    "part of a row as a port": (
        of("electrical [0:3] p; pair x(p[1:2]); analog begin V(p[0]) <+ 0; V(p[3]) <+ 0; V(p[1], in) <+ 0; V(p[2], out) <+ "
            "0; end",
           "module pair(a); inout [0:1] a; electrical [0:1] a; analog V(a[0], a[1]) <+ 1k * I(a[0], a[1]); endmodule\n"), 0.25),
    "nodes in braces as a port": (
        of("pair x({in, out});",
           "module pair(a); inout [0:1] a; electrical [0:1] a; analog V(a[0], a[1]) <+ 1k * I(a[0], a[1]); endmodule\n"), 0.25),
    "row of instances, one node shared": (
        of("electrical [0:1] p; r #(2k) x[0:1](p, out); analog begin V(p[0], in) <+ 0; V(p[1], in) <+ 0; end"), 0.25),
    "generate for": (
        of("electrical [0:4] n; genvar i; generate for (i = 0; i < 4; i = i + 1) begin : g r #(.r(250)) x(n[i], n[i + 1]); end"
           " endgenerate analog begin V(n[0], in) <+ 0; V(out, n[4]) <+ 0; end"), 0.25),
    "generate if": (
        of("parameter integer two = 1; generate if (two) r #(.r(1k)) x(in, out); else r #(.r(3k)) x(in, out); "
            "endgenerate"), 0.25),
    "generate for without its word": (
        of("genvar i; for (i = 0; i < 2; i = i + 1) r #(.r(2k)) x(in, out);"), 0.25),
    "generated analogue blocks": (
        of("real s; genvar i; analog s = 0; generate for (i = 1; i < 4; i = i + 1) analog s = s + i; endgenerate"
           " analog begin end generate analog V(out) <+ s; endgenerate"), 6),
    "defparam": (of("r x(in, out); defparam x.r = 1k;"), 0.25),
    "parameters in order and by name": (of("electrical n; r #(400) x(in, n); r #(.r(600)) y(.a(n), .b(out));"), 0.25),
    "paramset": (
        "module r(in, out); inout in, out; electrical in, out; parameter real r = 1; analog V(in, out) <+ r * I(in, out); "
            "endmodule\n"
        "paramset m r; parameter real k = 2; .r = 500 * k; endparamset\n", 0.25),
    "replication": (plain("x = '{3{2.0}}; V(out) <+ x[0] + x[1] + x[2];", "real x[0:2];"), 6),
    "replication within a row": (
        plain("V(out) <+ x[0] + 10 * x[1] + 100 * x[3];", "parameter real x[0:3] = '{1, 2{2}, 3};"), 321),
    "element that a voltage chooses": (plain("x = '{0, 10, 20}; k = 4 * V(in); V(out) <+ x[k];", "real x[0:2]; integer k;"), 20),
    "function that gives values back": (
        of("real y; analog function real f; input x; output y; real x, y; begin y = 2 * x; f = x * x; end endfunction"
           " analog V(out) <+ f(V(in), y) + y;"), 1.25),
    "case, while, repeat": (
        plain("i = 0; s = 0; while (i < 4) begin s = s + V(in); i = i + 1; end repeat (2) s = s + 1; case (i) 3: s = 0; 4: "
            "s = s + 1;"
              " default: s = 9; endcase V(out) <+ s;", "integer i; real s;"), 5),
    "analog initial": (of("real x; analog initial x = 3; analog V(out) <+ x;"), 3),
    "default of $simparam": (of('parameter real t = $simparam("tnom", 20); analog V(out) <+ t;'), 27),
    "ddx": (plain("g = ddx(V(in) * V(in), V(in)); V(out) <+ g;", "real g;"), 1),
    "flow into a port": (plain("I(in) <+ V(in) / 1k; V(out) <+ 2k * I(<in>);"), 1),
    "$random of a constant seed": (
        plain("@(initial_step) begin s = 1; x = $random(s); end V(out) <+ x;", "integer s, x;"), 69070),
    "$dist_uniform of whole numbers": (plain("s = 1; x = $dist_uniform(s, 3, 3); V(out) <+ x;", "integer s, x;"), 3),
    "$table_model of rows": (
        plain("x = '{0, 1, 2}; y = '{0, 4, 5}; V(out) <+ $table_model(V(in), x, y, \"1C\");", "real x[0:2], y[0:2];"), 2),
    "slew at rest": (plain("V(out) <+ slew(V(in), 1);"), 0.5),
    "zi_nd at rest": (plain("V(out) <+ zi_nd(V(in), '{1}, '{1, -0.5}, 1m);"), 1),
}  # fmt: skip
IN_A_RUN: dict[str, tuple[str, float]] = {
    "idt": (plain("V(out) <+ idt(V(in), 1);"), 1.5),
    "idt with a reset": (plain("V(out) <+ idt(1, 0, V(in) < 0.25);"), 0.75),
    "idtmod": (plain("V(out) <+ idtmod(3 * V(in), 0, 1);"), 0.5),
    "ddt": (plain("V(out) <+ ddt(3 * V(in));"), 3),
    "analysis and $abstime": (plain('V(out) <+ analysis("tran") + $abstime;'), 2),
    "absdelay": (plain("V(out) <+ absdelay(V(in), 0.25);"), 0.75),
    "laplace_nd": (plain("V(out) <+ laplace_nd(V(in), '{1}, '{1, 0.05});"), 0.95),
    "transition": (plain("V(out) <+ transition(V(in) > 0.75 ? 1 : 0, 0, 1);"), 0.25),
    "slew": (plain("V(out) <+ slew(V(in), 0.25);"), 0.25),
    "cross with a direction, tolerances and a switch": (
        plain("@(cross(V(in) - 0.5, 1, 1n, 1n, 1)) n = n + 1; @(cross(V(in) - 0.5, 1, 1n, 1n, 0)) n = n + 10; V(out) <+ "
            "n;", "integer n;"), 1),
    "above": (plain("@(above(V(in) - 0.5)) n = n + 1; V(out) <+ n;", "integer n;"), 1),
    "timer": (plain("@(timer(0.25, 0.25)) n = n + V(in); V(out) <+ n;", "real n;"), 1.5),
    "timer with a switch": (plain("@(timer(0.3, 0.3, 1n, V(in) > 0.5)) n = n + 1; V(out) <+ n;", "integer n;"), 2),
    "timer of a variable": (
        plain("@(initial_step) next = 0.1; @(timer(next)) begin n = n + 1; next = 2 * next; end V(out) <+ n;", "real next; "
            "integer n;"), 4),
    "absdelta": (plain("@(absdelta(V(in), 0.3)) x = V(in); V(out) <+ x;", "real x;"), 0.9),
    "last_crossing": (plain("V(out) <+ last_crossing(V(in) - 0.5, 1);"), 0.5),
    "variable of events": (plain("@(initial_step) x = 2; @(cross(V(in) - 0.5)) x = x + V(in); V(out) <+ x;", "real x;"), 2.5),
    "row of events": (plain("@(timer(0.2, 0.2)) begin x[1] = x[0]; x[0] = $abstime; end V(out) <+ x[1];", "real x[0:1];"), 0.6),
    "variable that keeps its value": (plain("if (V(in) < 0.5) x = V(in); V(out) <+ x;", "real x = 0;"), 0.5),
    "event in a loop over genvar": (
        of("integer n[0:1]; genvar i; analog begin for (i = 0; i < 2; i = i + 1) @(cross(V(in) - 0.3 * (i + 1), 1)) n[i] = i + 1;"
           " V(out) <+ n[0] + n[1]; end"), 3),
    "generated event": (
        of("integer n; genvar i; generate for (i = 1; i < 4; i = i + 1) analog @(timer(0.2 * i)) n = n + i; endgenerate"
                           " generate analog V(out) <+ n; endgenerate"), 6),
    "zi_nd": (plain("V(out) <+ zi_nd(V(in), '{0, 1}, '{1}, 0.4, 0, 0.1);"), 0.5),
    "$rdist_uniform at events": (
        plain("@(initial_step) s = 7; @(timer(0.1, 0.1)) x = $rdist_uniform(s, 2, 2); V(out) <+ x;", "integer s; real x;"), 2),
    "final_step and $strobe": (plain('@(final_step) $strobe("the end"); V(out) <+ 1;'), 1),
}  # fmt: skip


def run(tmp_path: Path, module: str, deck: str) -> emsim.Result:
    (tmp_path / "m.va").write_text(HEAD + module)
    (tmp_path / "deck.cir").write_text(
        f"title\n.hdl m.va\n{deck}\nN1 in out x\nR1 out 0 1k\n.model x m\n.end\n"
    )
    return emsim.run(tmp_path / "deck.cir")


@pytest.mark.parametrize("name", AT_REST)
def test_at_an_operating_point(name: str, tmp_path: Path) -> None:
    module, wanted = AT_REST[name]
    assert run(tmp_path, module, OP + "\n.op")["v(out)"][-1] == pytest.approx(wanted, rel=1e-6)


@pytest.mark.parametrize("name", IN_A_RUN)
def test_in_a_run(name: str, tmp_path: Path) -> None:
    module, wanted = IN_A_RUN[name]
    found = run(tmp_path, module, RAMP + "\n.tran 5m 1\n.options reltol=1e-5")
    assert found.at("v(out)", 0.9999999) == pytest.approx(wanted, rel=1e-3)


def test_small_signals_and_noise(tmp_path: Path) -> None:
    stimulus = run(tmp_path, plain('V(out) <+ ac_stim("ac", 2, 0);'), OP + "\n.ac lin 1 1 1")
    assert abs(stimulus["v(out)"][0]) == pytest.approx(2)
    # from 1 to 4 (10^-18 A^2/Hz) between 1 Hz and 10 Hz: half of the line, the root of the power, and their integrals
    exponent = log10(4)
    cases = {"noise_table": (5.5, 2.5, 22.5), "noise_table_log": (10**0.5, 2.0, 39 / (exponent + 1))}
    for name, (at, between, integral) in cases.items():
        table = f'I(out) <+ {name}(\'{{10, 4e-18, 1, 1e-18}}, "n") + 2 * {name}(\'{{1, 1e-18}}, "m");'
        module = plain(table + " I(out) <+ V(out) / 1k; I(in) <+ V(in);")
        for frequency, density in ((0.1, 1.0), (at, between), (1e3, 4.0)):
            deck = (
                f"V1 in 0 0.5 ac 1\n.options temp=-273.1499\n.noise v(out) v1 lin 1 {frequency} {frequency}"
            )
            found = run(tmp_path, module, deck)["onoise_spectrum"][0]
            assert found**2 == pytest.approx((density + 4.0) * 1e-18 * 500**2, rel=1e-4)
        whole = run(
            tmp_path, module, "V1 in 0 0.5 ac 1\n.options temp=-273.1499\n.noise v(out) v1 lin 1000 1 10"
        )
        total = whole.table("integrated noise").column("onoise_total")[0]
        assert total**2 == pytest.approx((integral + 36.0) * 1e-18 * 500**2, rel=1e-3)


REFUSED = {
    "wreal": ("wreal w; analog V(out) <+ 1;", "wreal"),
    "always": ("reg q; always @(posedge q) q = 1; analog V(out) <+ 1;", "digital or structural"),
    "$fopen": ("integer f; analog begin f = $fopen(\"x\"); V(out) <+ 1; end", r"\$fopen is not supported"),
    "$fstrobe": ("analog begin $fstrobe(1, \"x\"); V(out) <+ 1; end", r"\$fstrobe is not supported"),
    "$sformat": ("string s; analog begin $sformat(s, \"x\"); V(out) <+ 1; end", r"\$sformat is not supported"),
    "$simprobe": ("analog V(out) <+ $simprobe(\"x\", \"y\", 0);", r"\$simprobe is not supported"),
    "node of an instance": ("r x(in, out); analog I(out) <+ V(x.a);", "names of other instances are not supported"),
    "defparam of nobody": ("defparam y.r = 1; analog V(out) <+ 1;", "there is no instance y"),
    "defparam below": ("r x(in, out); defparam x.y.r = 1;", "reaches into an instance of this module alone"),
    "delay that changes": ("analog V(out) <+ absdelay(V(in), V(in));", "a delay hangs on voltages"),
    "transition of what moves": ("analog V(out) <+ transition(V(in), 0, 1);", "changes between events"),
    "seed that is nowhere": ("integer x; analog begin x = $random; V(out) <+ x; end", r"\$random without a seed"),
    "replication without end": ("real x[0:1]; analog begin x = '{-1{2}}; V(out) <+ 1; end", "repeated -1 times"),
    "timer of a voltage": (
        "integer n; analog begin @(timer(V(in))) n = 1; V(out) <+ n; end", "a timer whose start or period hangs on voltages"),
    "generate by a voltage": ("generate if (V(in) > 1) r x(in, out); endgenerate", "what is generated hangs on voltages"),
    "casex": ("integer i; analog begin i = 1; casex (i) 1: V(out) <+ 1; endcase end", "casex"),
    "counter of evaluations": ("real n = 0; analog begin if (V(in) > 0) n = n + 1; V(out) <+ n; end", "n keeps its value"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_there_is_told_by_name_and_place(name: str, tmp_path: Path) -> None:
    text, said = REFUSED[name]
    with pytest.raises(emsim.DeckError, match=said) as trouble:
        run(tmp_path, of(text), OP + "\n.op")
    assert "m.va:" in str(trouble.value)


def test_a_module_by_x(tmp_path: Path) -> None:
    """X on a module of .hdl, within a subcircuit and with m=, and .hdl behind its use."""
    (tmp_path / "m.va").write_text(HEAD + R)
    (tmp_path / "deck.cir").write_text(
        "title\nV1 in 0 3\n.param big=500\nX1 in a r r={2*big}\n.subckt half p q\nX2 p q R r={k} m=2\n.param k=2k\n.ends\n"
        "X3 a 0 half\n.hdl m.va\n.op\n.end\n"
    )
    assert emsim.run(tmp_path / "deck.cir")["v(a)"][-1] == pytest.approx(1.5)
    (tmp_path / "deck.cir").write_text("title\nV1 in 0 3\nX1 in 0 r rr=2\n.hdl m.va\n.op\n.end\n")
    assert any("`r` takes no rr=" in str(d) for d in emsim.run(tmp_path / "deck.cir").diagnostics)
    (tmp_path / "deck.cir").write_text("title\nV1 in 0 3\nX1 in 0 0 r r=2\n.hdl m.va\n.op\n.end\n")
    with pytest.raises(emsim.DeckError, match="has 3 nodes, `r` 2 terminals"):
        emsim.run(tmp_path / "deck.cir")
