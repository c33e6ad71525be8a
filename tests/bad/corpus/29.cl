$$ expect: error cl.data-comment line=3
$$-> TOOLPATH / {"version": 1}
$$-> FRAME /{"urigin": [0, 0], "rotation": []}
UNITS/MT/0,0,0
