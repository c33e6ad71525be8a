"""How long a program takes on a machine under a control, with a band, and where the time goes."""
