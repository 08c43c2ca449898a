* The subcircuits behind KiCad's symbols Simulation_SPICE: OPAMP and the differential voltmeter, by their terminals and parameters.

* One pole, offset, output resistance; the output stays between the supplies. The law is that of KiCad's text, which is in the
* public domain (its author: Holger Vogt).
.subckt kicad_builtin_opamp in+ in- vcc vee out params: POLE=20 GAIN=20k VOFF=10m ROUT=10
Vos in+ a dc {VOFF}
Gin 0 b a in- 100u
Rp  b 0 {GAIN/100u}
Cp  b 0 {1/(6.28*(GAIN/100u)*POLE)}
Ebuf c 0 b 0 1
Ro  c out {ROUT}
Emin d 0 vee 0 1
Emax e 0 vcc 0 1
Dmin d b Dclip
Dmax b e Dclip
.model Dclip D N=0.01
.ends

.subckt kicad_builtin_opamp_dual out1 in1- in1+ vee in2+ in2- out2 vcc params: POLE=20 GAIN=20k VOFF=10m ROUT=10
X1 in1+ in1- vcc vee out1 kicad_builtin_opamp POLE={POLE} GAIN={GAIN} VOFF={VOFF} ROUT={ROUT}
X2 in2+ in2- vcc vee out2 kicad_builtin_opamp POLE={POLE} GAIN={GAIN} VOFF={VOFF} ROUT={ROUT}
.ends

.subckt kicad_builtin_vdiff in+ in- out
Ediff out 0 in+ in- 1
.ends
