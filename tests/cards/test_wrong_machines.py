"""Machines that are wrong, and what is said of each: the code, the line, the cards that are at fault, how much by where a
length or an angle is, and what to do."""

from __future__ import annotations

import re

import pytest
from machines import problems

ARM = "BODY arm shape=rod(1) m=1\nJOINT hinge 0 arm pin\n"
SLED = "BODY sled m=1\nJOINT rail 0 sled slide axis=(1,0)\n"
TWO = ARM + "BODY wheel m=1 j=1\nJOINT axle 0(2,0) wheel pin\n"
TRIANGLE = "BODY a shape=rod(1) m=1\nBODY b shape=rod(1) m=1\nJOINT p 0 a pin@\nJOINT q a(1,0) b pin\nJOINT r b(1,0) 0(@@,0) pin\n"

# ruff: noqa: E501
# what is wrong: the deck, the code, the line of the card that is named, words of the message, words of the hint
WRONG = {
    "a loop that cannot close": (TRIANGLE.replace("@@", "3").replace("@", ""), "E242", 6, r"joints q, p, r cannot close: 1 m are left at r", "."),
    "a start that the loop forbids": (TRIANGLE.replace("@@", "1.5").replace("@", " ic=0"), "E24", None, r"p|r", "."),
    "a start outside of a stop": (SLED.replace("(1,0)", "(1,0) ic=0.5") + "STOP end rail max=0.2 e=0.5", "E258", 4, r"STOP end .*0\.3 m", "0.3 m further off"),
    "a ball in the floor": ("BODY ball m=1 j=1 y=0.05\nCONTACT floor ball 0 line=(0,1) r=0.1 e=0.5", "E258", 3, r"CONTACT floor .*0\.05 m", "stiffness"),
    "a stop upside down": (SLED + "STOP end rail min=0.2 max=0.1 e=0.5", "E238", 4, "min=.*0.2.*max=.*0.1", "lower end"),
    "an impact that makes energy": (SLED + "STOP end rail max=0.1 e=1.2", "E238", 4, "STOP end is 1.2.*more energy", "no loss"),
    "damped twice": (SLED + "STOP end rail max=0.1 k=1k e=0.5 c=3", "E240", 4, "c= and e=", "leave one"),
    "friction that holds less than it rubs": (ARM + "FRICTION f hinge fc=2 fs=1", "E238", 4, "fs=.*1, less than fc= 2", "larger"),
    "friction below nothing": (ARM + "FRICTION f hinge fc=-2", "E238", 4, "fc=.*-2", ""),
    "teeth that do not say how they meet": (TWO + "GEAR g hinge axle ratio=2 backlash=0.1", "E230", 6, "GEAR g.*e=.*k=", "form|GEAR"),
    "a gear that gives more than it gets": (TWO + "GEAR g hinge axle ratio=2 eta=1.2", "E238", 6, "eta= of GEAR g is 1.2", "0.95"),
    "a gear with play and losses": (TWO + "GEAR g hinge axle ratio=2 eta=0.9 backlash=0.1 e=0.5", "E240", 6, "eta= and backlash=", "FRICTION"),
    "a gear of ratio nought": (TWO + "GEAR g hinge axle ratio=0", "E238", 6, "ratio= of GEAR g", "DRIVE"),
    "a gear from a pin to itself": (ARM + "GEAR g hinge hinge ratio=2", "E237", 4, "GEAR g .*hinge", "two joints"),
    "a screw between two pins": (TWO + "GEAR g hinge axle lead=5m", "E240", 6, "lead= of GEAR g", ""),
    "a belt on a slide": (SLED + ARM + "BELT b rail hinge r1=0.1 r2=0.1 k=1k", "E241", 6, "BELT b .*rail is a slide", "GEAR"),
    "a belt without elasticity": (TWO + "BELT b hinge axle r1=0.1 r2=0.1", "E230", 6, "BELT b needs k=", "BELT"),
    "a cam that moves by itself": (SLED + ARM + "CAM c rail hinge lift={1m*sin(time)}", "E252", 6, "CAM c reads time", "DRIVE"),
    "a cam that reads another joint": (SLED + TWO + "CAM c rail hinge lift={1m*angle(axle)}", "E252", 8, r"CAM c reads angle\(axle\)", "second CAM|DRIVE"),
    "a cam that stands still": (SLED + ARM + "CAM c rail hinge lift=2m", "E252", 6, "CAM c does not depend", r"angle\(hinge\)"),
    "a screw that does not advance": ("BODY nut m=1 j=(1,1,1)\nJOINT s 0 nut screw", "E230", 3, "JOINT s needs lead=", "pin"),
    "axes of a cross that are not square": ("BODY a m=1 j=(1,1,1)\nJOINT u 0 a universal axis=(1,0,0) axis2=(1,1,0)", "E232", 3, "axis2= of JOINT u", "right angles"),
    "one angle of a ball joint": ("BODY b m=1 j=(1,1,1)\nJOINT o 0 b ball\nTORQUE t b tau={angle(o)}", "E249", 4, "o is a ball", "e0"),
    "a spring on a ball joint": ("BODY b m=1 j=(1,1,1)\nJOINT o 0 b ball\nSPRING s o k=1", "E241", 4, "SPRING s .*o is a ball", ""),
    "six numbers are wanted in space": ("BODY b m=1 j=(1,1,1)\nJOINT f 0 b free ic=(0,0,0)\n.gravity 0 0 -9", "E232", 3, "ic= of JOINT f has 3 .*6 or 12", "."),
    "an inertia about one axis in space": ("BODY b m=1 j=1\nFORCE f b dir=(0,0,1) 1", "E248", 2, "body b turns out of the plane", r"j=\(Jxx"),
    "a body that weighs and turns nothing": ("BODY a m=0\nJOINT p 0 a pin", "E243", 2, "a|p", "."),
    "a joint driven twice": (ARM + "DRIVE d hinge q={time}\nDRIVE e hinge q={2*time}", "E245", 5, "hinge is driven twice, by d and e", "TORQUE"),
    "a joint between a body and itself": ("BODY a m=1 j=1\nJOINT p a a(1,0) pin", "E237", 3, "JOINT p ties a to itself", "two bodies"),
    "a spring without a direction": ("BODY a m=1 j=1 x=1\nSPRING s a 0(1,0) k=1 l0=0.5", "E257", 3, "SPRING s coincide", "start"),
    "a name that is near another": (ARM + "DAMPER d hing c=1", "E236", 4, "hing is no joint", "hinge"),
    "a motor that turns nothing": (ARM + "MOTOR m a 0 hinge kt=1 r=1 gear=0\nV1 a 0 1", "E238", 4, "gear= of MOTOR m", ""),
    "two wires for three phases": (ARM + "MOTOR m a b hinge model=s\n.model s pmsm p=2 ld=1m psi=0.1\nV1 a 0 1\nV2 b 0 1", "E233", 4, "MOTOR m has 3 .*4 or 5", r"a b c \[n\]"),
    "a motor of no kind": (ARM + "MOTOR m a 0 hinge model=s\n.model s npn\nV1 a 0 1", "E253", 4, "type npn", "pmsm"),
    "half a data sheet": (ARM + "MOTOR m a 0 hinge model=s\n.model s dcmotor vnom=9 istall=3\nV1 a 0 1", "E230", 4, "missing: n0=, i0=", "vnom= n0= i0= istall="),
    "energy out of nothing": (SLED + "TRANSDUCER t a 0 rail L={1m*(1+time)}\nV1 a 0 1", "E252", 4, "TRANSDUCER t .*time", "DRIVE"),
    "a winding that links nothing": (SLED + "TRANSDUCER t (a 0 b 0) (rail) W={i(t,1)^2*pos(rail)}\nV1 a 0 1\nV2 b 0 1", "E252", 4, r"i\(t,2\).*short circuit", "leave"),
    "a unit that is none": (SLED + "SPRING s rail k=5foo", "E111", 4, "5foo", "."),
}  # fmt: skip


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_machine_is_told_what_where_and_what_to_do(what: str) -> None:
    cards, code, line, message, hint = WRONG[what]
    errors = [d for d in problems(cards) if d.severity == "error"]
    assert errors, "nothing was said"
    first = next((d for d in errors if d.code.startswith(code)), errors[0])
    assert first.code.startswith(code), f"{first.code} {first.message}"
    assert first.span is not None
    if line is not None:
        assert first.span.line == line
    assert re.search(message, first.message), first.message
    if hint:
        assert first.hint and re.search(hint, first.hint), first.hint


def test_there_are_thirty_of_them() -> None:
    assert len(WRONG) >= 30
