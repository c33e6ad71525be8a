(Exported by FreeCAD)
(Post Processor: linuxcnc_post)
(Output Time:2026-01-02 10:11:12)
(begin preamble)
G17 G54 G40 G49 G80 G90
G21
(begin operation: TC: 8 mm mill)
(machine units: mm/min)
M6 T2 G43 H2
M3 S3000
(finish operation: TC: 8 mm mill)
(begin operation: Profile)
M8
G0 Z5.000
G0 X10.000 Y0.000
G0 Z2.000
G1 X10.000 Y0.000 Z-1.000 F120.000
G3 X0.000 Y10.000 Z-1.000 I-10.000 J0.000 K0.000 F300.000
G2 X0.000 Y10.000 Z-2.000 I0.000 J-5.000 K0.000 F300.000
G1 X-5.000
G0 Z5.000
(finish operation: Profile)
(begin operation: Drilling)
G98
G83 X-20.000 Y0.000 Z-12.000 F60.000 Q4.000 R3.000
G83 X-30.000 Y0.000 Z-12.000 F60.000 Q4.000 R3.000
G80
G99
G82 X-40.000 Y0.000 Z-3.000 F60.000 P0.500 R3.000
G80
G0 Z5.000
(finish operation: Drilling)
M9
(begin postamble)
M05
G17 G54 G90 G80 G40
M2
