"""What a module tells of its operating point, of m= in parallel: by the attribute `multiplicity` (Verilog-AMS 2.4, 3.2.1)."""

from __future__ import annotations

from pathlib import Path

import pytest

import emsim

MODULE = """`include "disciplines.vams"
module cell(a, b);
inout a, b;
electrical a, b;
parameter real r = 50 from (0:inf);
(* desc="conductance", units="S", multiplicity="multiply" *) real g;
(* desc="resistance", units="ohm", multiplicity="divide" *) real ohms;
(* desc="voltage", units="V", multiplicity="none" *) real v;
(* desc="of one", units="A" *) real one;
(* multiplicity="multiply" *) real hidden;
analog begin
    v = V(a, b);
    g = 1.0 / r;
    ohms = r;
    one = v / r;
    hidden = one;
    I(a, b) <+ hidden;
end
endmodule
"""


@pytest.mark.parametrize("m", [1, 4])
def test_output_variables_are_of_all_devices_where_the_module_says_so(m: int, tmp_path: Path) -> None:
    (tmp_path / "cell.va").write_text(MODULE)
    deck = tmp_path / "deck.cir"
    words = "@n1[g] @n1[ohms] @n1[v] @n1[one] i(v1)"
    deck.write_text(
        f"title\n.hdl cell.va\nn1 a 0 mm m={m}\n.model mm cell\nv1 a 0 2\n.op\n.print op {words}\n.end\n"
    )
    got = emsim.run(deck)
    read = [float(got[word][-1]) for word in words.split()]
    assert read == pytest.approx([m / 50, 50 / m, 2, 2 / 50, -2 * m / 50], rel=1e-12)
