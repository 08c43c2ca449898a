"""LTspice's standard symbols: what its drawings mean and do not hold. Prefix, value, pins in the order of the netlist, and where
the name and the value of the part are written.

The coordinates are those of the .asy files that come with LTspice (lib/sym), in its unit: a grid of 16.
"""

from __future__ import annotations

# name, prefix, value; pins `name:x,y` in the order of the netlist; places of name and value
TABLE = """
res R R A:16,16 B:16,96 36,40 36,76
res2 R R A:16,0 B:16,64 36,16 36,56
cap C C A:16,0 B:16,64 24,8 24,56
polcap C C A:16,0 B:16,64 24,8 24,57
ind L L A:16,16 B:16,96 36,40 36,80
ind2 L L A:16,16 B:16,96 36,40 36,80
voltage V V +:0,16 -:0,96 24,16 24,96
current I I +:0,0 -:0,80 24,0 24,80
load I I A:16,0 B:16,64 48,8 48,56
load2 I I +:0,0 -:0,80 24,0 24,80
bi B I=F(...) +:0,0 -:0,80 24,0 24,80
bi2 B I=F(...) +:0,80 -:0,0 24,0 24,80
bv B V=F(...) +:0,16 -:0,96 24,16 24,96
e E E +:0,16 -:0,96 P:-48,32 N:-48,80 24,16 24,96
e2 E E +:0,16 -:0,96 P:-48,80 N:-48,32 24,16 24,96
g G G +:0,96 -:0,16 NC+:-48,32 NC-:-48,80 24,16 24,96
g2 G G +:0,96 -:0,16 NC+:-48,80 NC-:-48,32 24,16 24,96
f F F +:0,0 -:0,80 24,0 24,80
h H H +:0,16 -:0,96 24,16 24,96
sw S SW A:0,16 B:0,96 NC+:-48,80 NC-:-48,32 24,16 24,96
csw W CSW +:0,0 -:0,80 24,0 24,88
diode D D +:16,0 -:16,64 24,0 24,64
schottky D D +:16,0 -:16,64 24,0 24,64
zener D D +:16,0 -:16,64 24,0 24,64
varactor D D +:16,0 -:16,64 24,0 24,64
led D D +:16,0 -:16,64 24,0 24,64
tvsdiode D D +:16,0 -:16,64 24,0 24,64
npn QN NPN C:64,0 B:0,48 E:64,96 56,32 56,68
npn2 QN NPN C:64,0 B:0,48 E:64,96 56,32 56,68
npn3 QN NPN C:64,0 B:0,48 E:64,96 56,32 56,68
npn4 QN NPN C:64,0 B:0,48 E:64,96 S:64,48 72,32 72,68
pnp QP PNP C:64,0 B:0,48 E:64,96 84,32 84,68
pnp2 QP PNP C:64,0 B:0,48 E:64,96 84,32 84,68
pnp4 QP PNP C:64,0 B:0,48 E:64,96 S:64,48 72,32 72,68
lpnp QP LPNP C:64,0 B:0,48 E:64,96 S:64,48 72,32 72,68
nmos MN NMOS D:48,0 G:0,80 S:48,96 56,32 56,72
nmos4 MN NMOS D:48,0 G:0,80 S:48,96 B:48,48 56,32 56,72
pmos MP PMOS D:48,0 G:0,80 S:48,96 56,32 56,72
pmos4 MP PMOS D:48,0 G:0,80 S:48,96 B:48,48 56,32 56,72
njf JN NJF D:48,0 G:0,64 S:48,96 56,32 56,72
pjf JP PJF D:48,0 G:0,64 S:48,96 56,32 56,72
mesfet Z NMF D:48,0 G:0,80 S:48,96 56,32 56,72
tline T Td=50n|Z0=50 I1:-48,-16 R1:-48,16 I2:48,-16 R2:48,16 0,-16 0,16
ltline O LTRA I1:-48,-16 R1:-48,16 I2:48,-16 R2:48,16 0,-16 0,16
battery V V +:0,16 -:0,96 24,16 24,104
cell V V +:0,0 -:0,64 24,8 24,56
signal V SINE(0|1|1K) +:0,16 -:0,96 24,16 24,104
europeanresistor R R A:16,16 B:16,96 31,40 31,76
europeancap C C A:16,0 B:16,64 24,4 24,64
europeanpolcap C C A:16,0 B:16,64 24,4 24,64
fixedind L L A:16,16 B:16,96 36,40 36,80
xtal C C A:16,0 B:16,64 24,0 24,72
epoly E POLY() +:0,16 -:0,96 24,16 24,104
gpoly G POLY() +:0,96 -:0,16 24,16 24,104
urc U URC A:16,16 B:16,80 C:-16,48 36,32 36,72
urc2 U URC A:16,0 B:16,64 C:-16,32 36,16 36,56
jumper - - +:-32,64 -:32,64 0,40 0,40
opamp X opamp invin:-32,48 noninvin:-32,80 out:32,64 8,32 8,96
opamp2 X opamp2 In+:-32,80 In-:-32,48 V+:0,32 V-:0,96 OUT:32,64 16,32 16,96
"""
# attributes of those that have more than a prefix and a value
MORE = {"opamp": {"SpiceLine": "Aol=100K", "SpiceLine2": "GBW=10Meg"}}
# parts whose law is LTspice's own and no card of SPICE
OWN = frozenset(
    "and or xor buf buf1 inv dflop srflop schmitt schmtbuf schmtinv diffschmitt diffschmtbuf diffschmtinv phidet phasedet "
    "counter modulate modulate2 sample samplehold varistor ota".split()
)


class Standard:
    """A symbol: `pins` are (name, x, y) in the order of the netlist, `windows` where name and value stand."""

    __slots__ = ("attributes", "pins", "windows")

    def __init__(self, words: list[str]) -> None:
        name, prefix, value = words[:3]
        own = {} if prefix == "-" else {"Prefix": prefix, "Value": value.replace("|", " ")}
        self.attributes = {**own, **MORE.get(name, {})}
        self.pins = [(at.rpartition(":")[0], *_point(at.rpartition(":")[2])) for at in words[3:-2]]
        self.windows = {0: _point(words[-2]), 3: _point(words[-1])}


def _point(text: str) -> tuple[int, int]:
    x, y = text.split(",")
    return int(x), int(y)


def standard() -> dict[str, Standard]:
    """All of them, by their names in small letters."""
    return {words[0]: Standard(words) for words in map(str.split, TABLE.strip().split("\n"))}
