"""Small programs of every kind of motion, to time on LinuxCNC: machine, text, registers of tool lengths (all 0)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

import machines
from machines.machine import Machine, Timing

Extra = Callable[[int], str]
HEAD = "G21 G90 G94 G17"


@cache
def machine(name: str) -> Machine:
    """A machine without times of its own: the simulator changes tools and clamps axes in no time."""
    return replace(machines.load(name), timing=Timing())


def circle(count: int, radius: float, extra: Extra = lambda i: "") -> str:
    """A circle of straight lines through the origin."""
    angles = [2.0 * math.pi * i / count for i in range(1, count + 1)]
    return "".join(f"G1 X{radius * math.cos(a) - radius:.5f} Y{radius * math.sin(a):.5f}{extra(i)}\n"
                   for i, a in enumerate(angles, 1))


def turned(i: int) -> str:
    return f" A{10.0 * math.sin(i / 30):.4f} C{0.3 * i:.4f}"


def random_lines(count: int) -> str:
    points = np.cumsum(np.random.default_rng(3).normal(0.0, 3.0, (count, 3)), axis=0) * [1.0, 1.0, 0.2]
    return "".join(f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f}\n" for x, y, z in points)


def finishing(count: int) -> str:
    return "".join(
        f"G1 X{0.4 * i:.4f} Y{5.0 * math.sin(i / 8):.4f} Z{240.0 - 3.0 * math.cos(i / 11):.4f} "
        f"A{20.0 + 8.0 * math.sin(i / 25):.4f} C{0.7 * i:.4f} F{3000.0 * (1.0 + 0.3 * math.sin(i / 9)):.3f}\n"
        for i in range(1, count))


def zigzag(count: int, step: float) -> str:
    return "".join(f"G1 X{(i % 2) * 20} Y{i * step:g}\n" for i in range(1, count + 1))


ARCS = "G0 X0 Y0 Z300\n" + "".join(
    f"G2 X{20 * (i + 1)} Y0 I10 J0\nG3 X{20 * (i + 1)} Y-20 I0 J-10\nG1 Y0\n" for i in range(4))
HELIX = "G0 X0 Y0 Z300\n" + "".join(f"G2 X0 Y0 Z{295 - 5 * i} I15 J0\n" for i in range(3)) + "G1 Z300\n"
RAPIDS = "".join(f"G0 X{(i % 3) * 60} Y{(i % 5) * 40}\nG0 Z{300 - (i % 2) * 80}\n" for i in range(10))
CYCLES = ("G0 Z300\nG98 G81 X0 Y0 Z280 R290 F800\nX20\nX40 Y20\nG80\nG99 G83 X0 Y40 Z275 R290 Q5 F600\nX30\nG80\nG0 Z320\n"
          "G98 G82 X-20 Y0 Z285 R290 P0.5 F500\nX-40\nG80\n")
ROTARY = "".join(f"G1 A{20 * (i % 3)} C{i * 25}\n" for i in range(1, 9)) + "G0 A0 C0\nG0 C90\n"
INDEXED = "".join(f"G1 X{i * 2} Z{450 - (i % 3)} A{i * 4}\n" for i in range(1, 45))
COMMANDS = "M3 S1000\nF2000\nG1 X20\nG4 P1.5\nG1 Y20\nM8\nG1 X0\nM9\nG0 Z350\nM5\nG1 Y0\n"
SPEED = "".join(f"G1 X{0.5 * i:.1f}\n" for i in range(1, 500)) + "".join(
    f"G1 X249.5 Y{0.05 * i:.2f}\n" for i in range(1, 400))
SMALL_ARCS = "G0 X0 Y0 Z300\n" + "".join(
    f"G17 G2 X{4 * i + 4} Y0 I2 J0\nG18 G3 X{4 * i} Z300 I-2 K0\nG19 G2 Y0 Z300 J3 K0\nG0 X{4 * i + 4}\n" for i in range(8))
IN_TURN = "".join(f"G1 A{12 * (i % 2)} C{5 * i}\nG1 X{10 * i}\nG2 X{10 * i + 5} Y0 I2.5 J0\n" for i in range(1, 9))
STEADY = "".join(f"G1 X{0.5 * i:g} Y{5.0 * math.sin(i / 8):.4f} C{0.8 * i:.4f} F{500.0 + 50.0 * math.sin(i / 7):.2f}\n"
                 for i in range(1, 100))
WHOLE = "".join(f"G1 X{2 * i} A{i} F600\n" for i in range(1, 101))
"""each 100 ms, a multiple of the servo cycle"""


def in_whole_cycles(count: int, milliseconds: int, form: str) -> str:
    """Blocks of so many ms under G93; the letters of the form count mm and degrees a block."""
    return "".join(f"G1 {form.format(x=0.5 * i, y=5.0 * math.sin(i / 8), a=0.2 * i, c=2 * i)} F{60000 / milliseconds:g}\n"
                   for i in range(1, count + 1))


STEPS = "".join(f"G1 X{0.5 * i:.3f} Y{3 * math.sin(i / 12):.4f} F{3000 + 2500 * math.sin(i / 15):.0f}\n"
                for i in range(1, 250))
REPEATED = "G0 Z300\nF900\nG91 G81 X10 Y2 Z-8 R-2 L4\nG80 G90\nG0 Z310\n"
CHANGES = ("T1 M6\nG43 H1\nF2000\nG0 X20\nG1 Z350\nG1 Y20\nG0 Z400\nG49\nT2 M6\nG43 H2\nG0 X0\nG1 Z350\nG1 Y0\n")

PROGRAMS: dict[str, tuple[str, str]] = {
    "zigzag, G61.1": ("mill-3axis", f"{HEAD} G61.1\nF3000\n{zigzag(24, 2)}"),
    "zigzag, G64": ("mill-3axis", f"{HEAD} G64\nF3000\n{zigzag(24, 2)}"),
    "circle of lines, G64 P0.01": ("mill-3axis", f"{HEAD} G64 P0.01\nF3000\n{circle(377, 30.0)}"),
    "circle of lines, G61": ("mill-3axis", f"{HEAD} G61\nF3000\n{circle(200, 30.0)}"),
    "random lines, G64 P0.01": ("mill-3axis", f"{HEAD} G64 P0.01\nG0 Z300\nF4000\n{random_lines(100)}"),
    "random lines, G64 P0.1 Q0": ("mill-3axis", f"{HEAD} G64 P0.1 Q0\nG0 Z300\nF4000\n{random_lines(100)}"),
    "arcs, G64 P0.05": ("mill-3axis", f"{HEAD} G64 P0.05\nF3000\n{ARCS}"),
    "arcs, G61": ("mill-3axis", f"{HEAD} G61\nF3000\n{ARCS}"),
    "helices, G64 P0.02": ("mill-3axis", f"{HEAD} G64 P0.02\nF4000\n{HELIX}"),
    "rapids, G64 P0.02": ("mill-3axis", f"{HEAD} G64 P0.02\n{RAPIDS}"),
    "canned cycles": ("mill-3axis", f"{HEAD} G64 P0.02\n{CYCLES}"),
    "inch": ("mill-3axis", "G20 G90 G94 G64 P0.001\nF120\n" + "".join(
        f"G1 X{(i % 2) * 1.5} Y{i * 0.2:.2f}\n" for i in range(1, 12)) + "G0 Z13\n"),
    "a feed in every line": ("mill-3axis", f"{HEAD} G64 P0.02\nG0 Z300\n{STEPS}"),
    "units that change": ("mill-3axis", "G21 G90 G94 G17 G61\nF600\nG1 X10\nG20\nG1 X1\nG21\nG1 X40\nG20 F900\nG1 X1\n"),
    "spindle, coolant, dwell": ("mill-3axis", f"{HEAD} G64 P0.01\n{COMMANDS}"),
    "cycles repeated, no G98": ("mill-3axis", f"{HEAD} G64 P0.02\n{REPEATED}"),
    "5 axes at their feed, G93": ("mikron-ucp710", f"{HEAD} G64 P0.02\nG0 Z240\nG93\n{STEADY}G94\n"),
    "5 axes at their feed, tip": ("linuxcnc-xyzac-trt", f"{HEAD} G64 P0.02\nG0 Z300\nG93\n{STEADY}G94\n"),
    "5 axes, G93, whole cycles": ("mikron-ucp710", f"{HEAD} G64 P0.02\nG0 Z240 X0 A0\nG93\n{WHOLE}G94\n"),
    "5 axes, G93, whole cycles of 20 ms": (
        "mikron-ucp710", f"{HEAD} G64 P0.02\nG0 Z240 X0 A0\nG93\n" + in_whole_cycles(200, 20, "X{x:g} A{a:g}") + "G94\n"),
    "5 axes, G93, whole cycles of 50 ms": (
        "mikron-ucp710", f"{HEAD} G64 P0.02\nG0 Z240 X0 A0\nG93\n" + in_whole_cycles(80, 50, "C{c:g}") + "G94\n"),
    "tip, G93, whole cycles of 20 ms": (
        "linuxcnc-xyzac-trt", f"{HEAD} G64 P0.02\nG0 Z300\nG93\n" + in_whole_cycles(200, 20, "X{x:g} Y{y:.4f} C{c:g}")
        + "G94\n"),
    "tool changes": ("mill-3axis", f"{HEAD} G64 P0.01\n{CHANGES}"),
    "4 axes, G94, G64 P0.01": ("mill-4axis", f"{HEAD} G64 P0.01\nG0 Z450\nF2000\n{INDEXED}"),
    "5 axes, G94, G64 P0.01": ("mikron-ucp710", f"{HEAD} G64 P0.01\nF3000\n{circle(200, 30.0, turned)}"),
    "5 axes, G94, G61": ("mikron-ucp710", f"{HEAD} G61\nF3000\n{circle(120, 30.0, turned)}"),
    "5 axes, G93, G64 P0.01": ("mikron-ucp710", f"{HEAD} G64 P0.01\nG0 Z240 A20\nG93\n{finishing(200)}G94\n"),
    "5 axes, G93, G61": ("mikron-ucp710", f"{HEAD} G61\nG0 Z240 A20\nG93\n{finishing(120)}G94\n"),
    "rotary axes alone": ("mikron-ucp710", f"{HEAD} G64 P0.01\nF3600\n{ROTARY}"),
    "short lines at speed": ("mill-3axis", f"{HEAD} G64 P0.01 Q0\nF30000\n{SPEED}"),
    "straight chain, G64 Q0.01": ("mill-3axis", f"{HEAD} G64 P0.01\nF24000\n{SPEED}"),
    "small arcs in all planes": ("mill-3axis", f"{HEAD} G64 P0.01\nF12000\n{SMALL_ARCS}"),
    "rotary and linear in turn": ("mikron-ucp710", f"{HEAD} G64 P0.01\nG0 Z200\nF3000\n{IN_TURN}"),
    "5 axes, control's kinematics": ("linuxcnc-xyzac-trt", f"{HEAD} G64 P0.05\nG0 Z300\nF3000\n"
                                     + circle(150, 30.0, turned)),
}
END = "M2\n"
MEASURED = {
    "zigzag, G61.1": 10.058, "zigzag, G64": 5.579, "circle of lines, G64 P0.01": 3.800, "circle of lines, G61": 7.210,
    "random lines, G64 P0.01": 12.400, "random lines, G64 P0.1 Q0": 11.962, "arcs, G64 P0.05": 7.206, "arcs, G61": 7.289,
    "helices, G64 P0.02": 4.936, "rapids, G64 P0.02": 6.556, "canned cycles": 12.189, "inch": 8.946,
    "spindle, coolant, dwell": 4.399, "tool changes": 5.006, "4 axes, G94, G64 P0.01": 6.690,
    "5 axes, G94, G64 P0.01": 9.165, "5 axes, G94, G61": 7.768, "5 axes, G93, G64 P0.01": 14.288, "5 axes, G93, G61": 12.063,
    "rotary axes alone": 8.149, "short lines at speed": 1.202, "straight chain, G64 Q0.01": 0.961,
    "small arcs in all planes": 5.696, "rotary and linear in turn": 6.762, "5 axes, control's kinematics": 4.751,
    "cycles repeated, no G98": 3.602, "5 axes at their feed, G93": 11.992, "5 axes at their feed, tip": 12.377,
    "units that change": 4.985, "5 axes, G93, whole cycles": 10.209,
    "5 axes, G93, whole cycles of 20 ms": 7.579, "5 axes, G93, whole cycles of 50 ms": 9.544,
    "tip, G93, whole cycles of 20 ms": 8.007, "a feed in every line": 4.542}
"""s that LinuxCNC 2.9's simulator took, for where it is not installed"""
