$, exr cl.too.t
SEQNO/oo–––––––––––––––Í
LOADTL/0.5
–––––––––M
LOADTL/1.5
F/MM
LOADTL/1.5
TOOLNO/100,MMPM
GOTO/0PM
GOTO/0,0,0
