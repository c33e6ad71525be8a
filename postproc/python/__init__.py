"""The calls of the package: `postproc.convert`, `verify`, `time`, `orient`, `place`, `calibrate`, `analyse`."""
