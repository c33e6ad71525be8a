#!/bin/sh
# From a CL file of NX to a proved program:  postprocess.sh PART.cls PROGRAM
# MACHINE, CONTROLLER, SETUP say for what; NX_CL_COMMAND is run before it, where it is set, to write PART.cls.
# Exit code: that of postproc (0 written, 1 refused), 2 for wrong use, that of NX_CL_COMMAND where it fails.
set -u
if [ $# -ne 2 ]; then
    echo "postprocess.sh: name the CL file and the program, e.g. postprocess.sh part.cls part.mpf" >&2
    exit 2
fi
: "${MACHINE:?name the machine in MACHINE}" "${CONTROLLER:?name the control in CONTROLLER}"
if [ -n "${NX_CL_COMMAND:-}" ]; then
    sh -c "$NX_CL_COMMAND" || exit $?
fi
set -- convert "$1" -m "$MACHINE" -c "$CONTROLLER" -o "$2" --proof --json "$2.json"
if [ -n "${SETUP:-}" ]; then
    set -- "$@" --setup "$SETUP"
fi
exec "${POSTPROC:-postproc}" "$@"
