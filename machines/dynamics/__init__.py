"""Forces of the motors along a motion, what limits of them allow: inverse dynamics of chains and of platforms on legs."""
