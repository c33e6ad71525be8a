"""Words of the program's header that the reader looks for."""

from __future__ import annotations

FINGERPRINT = "fingerprint of the geometric errors"
"""before the eight hex digits of the error model that a program was written with"""
FEEDS = "fingerprint of the planned feeds"
"""before the eight hex digits of the F words"""
PENDING = "proof pending"
"""the line that says what is proved, while the program is written (`verification/proof_text.py`)"""
UNKNOWN = "--------"
"""in their place while the program is written"""
HEADER = 4000
"""characters of a program that hold its header"""
