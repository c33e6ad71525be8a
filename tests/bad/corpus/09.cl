$$ expect: ÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿÿ&ÿÿÿÿÿÿÿÿ
ROTATE/1,2,3
S/MM
FEDRAT/100M
GOTO/0-0Oxpect: error cl.arc-start line=4
UNITS/M/0-0,0
R$$ expect: w
GOHOME/ng cl.table line=5
NIT$$ expect: warning cl.ta
S/MM
FEDRAT/100M
GOtO/0-0Oxpect: error cl.arc-start line=4
UNITS/M/0M
GOTO/0-0Oxpect: error cl.arc-start line=4
UNITS/M/0-0,0
R$$ expect: w
GOHOME/ng cl.table l
LET$$ expect: warning cl.aft over the top, where the tosBALL7
TLDATåA/MIL
$$-> OPERATION/L,8.0000,4.0000,75.0000,0.0000,0.0000
MterTTER/IT$$ expect: warning cl.ta
S/MM
FEDRAT/100M
=4
UNITS/M/?-0,0
RO
$$-> WORDS/TABrning cl.table lineO
S/MM
FE
TPRINT/, expect: warning cl.afterTS/MM
FE
TPRINT/,MMPOTO
RETRCT//0,op at z = 14 mm.
TOOL PATH/DOME_SPI$$-> WORDS/TABr?-0,0
RO
$$-> WORDS/TABrning cl.table lineO
$$-> WORDS/TABrning clOUTTOL.table lRAL,TOOL,BALL7
TLDATåA/MIL
$$-> OPERATION/L,8.0000,4.0,PERMIN,000,75.0000,0.0000,0.0000
MterTS/MM
FE
ine=/1,2,TPRINT/, expect: warning cl.afterTS/MM
FE
TPRINT/,MMPOTO
RETRCT//0,0INI
GOTO/,30
1
,GOT0INI
GOTO/,0
1,GOTO/1,22,,

