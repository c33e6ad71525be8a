"""Text around a program that is no record: what a system prints before the first record and behind the last."""

from __future__ import annotations

import re

from toolpaths.cl.text.near import nearest
from toolpaths.cl.text.words import BARE_WORDS, SILENT, TEXT_WORDS
from toolpaths.pattern import pattern

SINGLE = pattern(r"[A-Z0-9_-]*[A-Z][A-Z0-9_-]*")
_RULE = pattern(r"([-=*_#~])\1{4,}")
_LISTING = pattern(r"\s*(?:Information listing created by\b|Tool Path Listing has \d+ lines?)",
                      re.IGNORECASE)
_LABELLED = pattern(r"[^\W\d][\w .()-]* ?:(?:\s|$)|[^\W\d][\w .()-]*  +:")
_NUMBERS = pattern(r"[-+.,\s\deEdD$]*")
_SENTENCE = pattern(r"[A-Za-z]+(?: +[A-Za-z']+){2,}[.!]?")
_PLAIN = pattern(r"[\w .,+-]+")
_SHORTEST = 3
"""letters below which every word is near another"""
_LONGEST = 16
"""characters of a record's word"""


def word_of(text: str) -> str:
    """The first word of a line."""
    return re.split(r"[^A-Z0-9_-]", text.strip().upper() + " ")[0]


def is_listing(text: str, before: bool, behind: bool, vocabulary: frozenset[str]) -> bool:
    """True for text that may be left out: rules and headings of a listing anywhere outside the program, what has the form
    `name : value` before it, and other words that resemble no record. Never a line of numbers."""
    text = text.strip()
    if not (before or behind):
        return word_of(text) in SILENT and _PLAIN.fullmatch(text) is not None
    if _RULE.fullmatch(text) or _LISTING.match(text):
        return True
    if _NUMBERS.fullmatch(text):
        return False
    if _SENTENCE.fullmatch(text):
        return True
    if before and _LABELLED.match(text):
        head = " ".join(text.split(":")[0].upper().split())
        return head not in vocabulary and not nearest(head, vocabulary)
    return "/" not in text and not _resembles(text, vocabulary)


def _resembles(text: str, vocabulary: frozenset[str]) -> bool:
    """True where one of the beginnings of a line is a known word, or one edit from it."""
    upper = re.sub(r"^[^A-Z0-9]+", "", text.upper())[:_LONGEST].lstrip("0123456789")
    words = upper.split()
    heads = {re.split(r"[^A-Z_-]", upper + " ")[0], re.split(r"[^A-Z ]", upper + "/")[0].strip(), upper, *words[:1],
             "".join(words[:2]), " ".join(words[:2])} - {""}
    if upper.startswith(TEXT_WORDS) or heads & vocabulary:
        return True
    if any(h.startswith(w) and h[len(w):] in vocabulary for h in heads for w in BARE_WORDS):
        return True  # two records, the end of the line between them lost
    return any(len(h) >= _SHORTEST and nearest(h, vocabulary) for h in heads)
