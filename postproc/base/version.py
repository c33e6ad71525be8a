"""The version of the package, as headers, reports and the command line name it."""

VERSION = "0.2.0"
