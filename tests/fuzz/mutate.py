"""Changes that know what a program is made of: lines, words, numbers. Bytes are changed by the fuzzer itself."""

from __future__ import annotations

import random
import re

NUMBER = re.compile(rb"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
NUMBERS = (b"0", b"-0.", b"1", b"-1", b".0001", b"1e-9", b"360", b"-180.5", b"99999.999", b"1e9", b"1e308", b"1e999",
           b"2147483648", b"00", b"+.5", b"7" * 40)


def mutated(data: bytes, most: int, seed: int) -> bytes:
    """The text with one to four changes of its lines and numbers, at most `most` bytes."""
    chance = random.Random(seed)
    for _ in range(chance.randint(1, 4)):
        data = chance.choice((_number, _number, _lines, _words))(data, chance)
    return data[:most]


def _number(data: bytes, chance: random.Random) -> bytes:
    """One number replaced by another of the text, by a special one, or by one nearby."""
    found = list(NUMBER.finditer(data))
    if not found:
        return data
    one = chance.choice(found)
    other = chance.choice((chance.choice(NUMBERS), chance.choice(found)[0], one[0][:-1], one[0] + b"5"))
    return data[:one.start()] + other + data[one.end():]


def _lines(data: bytes, chance: random.Random) -> bytes:
    """One line taken out, doubled, or put somewhere else."""
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    at, to = chance.randrange(len(lines)), chance.randrange(len(lines))
    kept = [] if chance.random() < 0.3 else [lines[at]]
    if chance.random() < 0.7:
        del lines[at]
    return b"".join([*lines[:to], *kept, *lines[to:]])


def _words(data: bytes, chance: random.Random) -> bytes:
    """A word of one line put into another."""
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    words = chance.choice(lines).split()
    at = chance.randrange(len(lines))
    if words:
        lines[at] = lines[at].rstrip(b"\r\n") + b" " + chance.choice(words) + b"\n"
    return b"".join(lines)
