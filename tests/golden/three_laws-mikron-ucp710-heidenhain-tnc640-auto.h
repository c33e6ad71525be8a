0 BEGIN PGM THREE_LAWS MM
1 BLK FORM 0.1 Z X-30 Y-41 Z-15.1962
2 BLK FORM 0.2 X+30 Y+15 Z+60
3 ; postproc 0.2.0
4 ; source three_laws.cls
5 ; machine mikron-ucp710
6 ; controller heidenhain-tnc640
7 ; proved by read-back, second reading: all 11 cuts within 0.0001 mm, 0.0243 degrees
8 ; tolerance 0.01 mm, axis tolerance 0.05 degrees
9 ; feed mode auto
10 ; setup without a file, fingerprint of the set-up 2477345d
11 ; words: machine coordinates without RTCP, tilted work planes, tool-centre-point control
12 ; work offset datum number 1 in machine coordinates: X0.0000 Y0.0000 Z0.0000 A0.0000 C0.0000
13 ; stock of the graphics: extents of the cuts ([rewind.stock] states none)
14 ; pivots that the control must hold, in machine coordinates, all axes at 0, anywhere along each axis:
15 ; from zero to A: kinematics, Trans X0.0000 Y0.0000 Z0.0000
16 ; from A to C: kinematics, Trans X0.0000 Y0.0000 Z0.0000
17 ; tool T1 EM10, diameter 10 mm, gauge length 120.0000 mm
18 ; tool T2 BM6, diameter 6 mm, gauge length 95.5000 mm
19 ; lengths off are taken up by registers: -50 mm and more to +21.096 mm, then T2 travel Z
20 ; needs option 9 for FUNCTION TCPM: Advanced Function Set 2
21 ; needs rotary values of 0 in datum number 1
22 ; needs option 8 for PLANE: Advanced Function Set 1
23 FUNCTION RESET TCPM
24 PLANE RESET STAY
25 CYCL DEF 247 DATUM SETTING ~
Q339=+1 ;DATUM NUMBER
26 CYCL DEF 32.0 TOLERANCE
27 CYCL DEF 32.1 T0.003
28 CYCL DEF 32.2 HSC-MODE:0 TA0.015
29 * - TOP
30 L Z+250 R0 FMAX M91
31 TOOL CALL 1 Z S6000
32 TOOL DEF 2
33 M3
34 M8
35 L A+0 C+0 FMAX
36 L X-30 Y-20 FMAX
37 L Z+100.1456 FMAX
38 PLANE SPATIAL SPA+0 SPB+0 SPC+0 TURN FMAX TABLE ROT
39 L X-30 Y-20 Z+50 FMAX
40 L Z+3 FMAX
41 L Z-2 F400
42 L X+20 F800
43 CC X+20 Y-10
44 C X+30 Y-10 DR+
45 L Y+15
46 L Z+50 FMAX
47 L Z+100.1456 FMAX
48 PLANE RESET STAY
49 * - FACE
50 L X-15 Y-39.641 Z+103.6443 A+30 C+0 R0 FMAX
51 PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN FMAX TABLE ROT
52 L X-15 Y-39.641 Z+51.3397 FMAX
53 L Z+13.3397 FMAX
54 L Z+9.8397 F400
55 CC X-5 Y-39.641
56 C X-5 Y-29.641 DR-
57 L Z+51.3397 FMAX
58 CYCL DEF 200 DRILLING ~
Q200=+2 ;SET-UP CLEARANCE ~
Q201=-6 ;DEPTH ~
Q206=+150 ;FEED RATE FOR PLNGNG ~
Q202=+6 ;PLUNGING DEPTH ~
Q210=+0 ;DWELL TIME AT TOP ~
Q203=+11.3397 ;SURFACE COORDINATE ~
Q204=+40 ;2ND SET-UP CLEARANCE ~
Q211=+0.5 ;DWELL TIME AT DEPTH ~
Q395=+0 ;DEPTH REFERENCE
59 L X+10 Y-39.641 R0 FMAX M99
60 L X+10 Y-31.641 R0 FMAX M99
61 L Z+103.6443 FMAX
62 PLANE RESET STAY
63 * - SWEEP
64 L Z+250 R0 FMAX M91
65 M9
66 M5
67 TOOL CALL 2 Z S9000
68 M3
69 L A+15 C+0 FMAX
70 L X+0 Y-3.7894 FMAX
71 L Z+102.7469 FMAX
72 FUNCTION TCPM F TCP AXIS POS PATHCTRL AXIS
73 L X+0 Y-20 Z+60 A+15 C+0 FMAX
74 L Z+5 F1200
75 L Y-10 Z+6 A+20
76 L X+1.1722 Y-7.0696 Z+6.1465 A+21.2462 C+4.0493
77 L X+2.4087 Y-3.9783 Z+6.3011 A+22.6541 C+7.8421
78 L X+3.2043 Y-1.9892 Z+6.4005 A+23.6028 C+10.0501
79 L X+4 Y+0 Z+6.5 A+24.5804 C+12.0945
80 L Z+60 FMAX
81 L X+10.841 Y-31.9254 Z+131.3787 FMAX
82 FUNCTION RESET TCPM
83 L Z+250 FMAX M91
84 L X+0 Y+0 A+0 C+0 FMAX M91
85 M5
86 M30
87 END PGM THREE_LAWS MM
