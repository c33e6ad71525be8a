@echo off
rem From a CL file of NX to a proved program:  postprocess.bat PART.cls PROGRAM
rem MACHINE, CONTROLLER, SETUP say for what; NX_CL_COMMAND is run before it, where it is set, to write PART.cls.
rem Exit code: that of postproc (0 written, 1 refused), 2 for wrong use, that of NX_CL_COMMAND where it fails.
setlocal
if "%~2"=="" (
    echo postprocess.bat: name the CL file and the program, e.g. postprocess.bat part.cls part.mpf 1>&2
    exit /b 2
)
if not defined MACHINE (echo name the machine in MACHINE 1>&2 & exit /b 2)
if not defined CONTROLLER (echo name the control in CONTROLLER 1>&2 & exit /b 2)
if not defined POSTPROC set "POSTPROC=postproc"
if not defined NX_CL_COMMAND goto convert
call %NX_CL_COMMAND%
if errorlevel 1 exit /b %errorlevel%
:convert
set "MORE="
if defined SETUP set MORE=--setup "%SETUP%"
"%POSTPROC%" convert "%~1" -m "%MACHINE%" -c "%CONTROLLER%" -o "%~2" --proof --json "%~2.json" %MORE%
exit /b %errorlevel%
