"""The circuit, drawn from its netlist. Nothing here computes: a flat deck goes in, a picture as plain data comes out.

circuit.py   the deck's cards as parts with pins, nets, which nets are ground and rails; boxes.py, coils.py, reads.py, labels.py
layout.py    how each part may stand, what is wished of parts; the engine places and wires them
symbols.py   what parts look like
picture.py   the whole in pixels: `Picture`
back.py      ... read back from its lines, dots and words, and compared with the deck
svg.py       ... as a file; page and film draw the same data
"""
