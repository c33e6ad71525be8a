"""The spellings of SolidWorks CAM (.apt and .clt), CATIA and NCL; see spellings.py."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import atan2

import numpy as np
from cltext import UP, WORLD, Floats, Triple, number
from spellings import Operation, Spelling


def short(value: float, decimals: int = 6) -> str:
    """SolidWorks: `10.`, `.5`, `0`."""
    text = number(value, decimals).rstrip("0")
    text = {"0.": "0", "-0.": "0"}.get(text, text)
    return text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text


@dataclass
class SolidWorks(Spelling):
    """SolidWorks CAM .apt: CSYS and, on tilted faces, six numbers in the common frame; arcs without a radius."""

    def head(self) -> None:
        self.lines += ["$$ One path, spelt six ways: APT of a SolidWorks post.", "PARTNO/1", "MACHIN/PWORKS,0",
                       f"UNIT/{'MM' if self.unit == 'MM' else 'INCH'}", "SETUP/START,1"]

    def text_of(self, values: Iterable[float], decimals: int | None = None) -> str:
        return ",".join(short(v) for v in self.length(*values))

    def vector(self, values: Iterable[float]) -> str:
        return ",".join(short(v, 9) for v in values)

    def begin(self, op: Operation) -> None:
        self.operation, t, f = op, op.tool, op.frame
        rows = np.column_stack((f.rotation, np.asarray(self.length(*f.origin))))
        half = t.diameter / 2
        self.lines += [f"CUTTER/{self.text_of((t.diameter, 0, half, 0))},{short(90 - t.tip / 2) if t.tip else '0'},0,"
                       f"{self.text_of((t.length,))}", f"CSI_SET_FLUTE_LENGTH/{self.text_of((t.length,))}",
                       f"LOAD/TOOL,{t.number}", "TRNTYP/WORLD,0,0,0", f"CSYS/{self.vector(rows.ravel())}",
                       f"INSERT/[HOLDER=C40] {t.name}", f"SPINDL/{op.rpm},RPM,CLW", "COOLNT/FLOOD"]

    def goto(self, point: Triple, axis: Triple) -> str:
        assert self.operation is not None
        six = self.operation.frame is not WORLD or tuple(axis) != UP or tuple(self.axis) != UP
        return f"GOTO/{self.text_of(point)}" + (f",{self.vector(axis)}" if six else "")

    def rapid(self, point: Triple, axis: Triple = UP) -> None:
        self.lines.append("RAPID/")
        self.go(point, axis)

    def feed(self, rate: float) -> None:
        self.lines.append(f"FEDRAT/{self.text_of((rate,))},{self.feed_unit}")

    def circle(self, at_start: Floats, at_end: Floats, normal: Floats, radius: float, end: Floats,
               turns: int) -> None:
        self.lines += [f"CIRCLE/{self.text_of(at_start)},{self.vector(normal)}", self.goto(end, self.axis)]

    def cycle(self, depth: float, clear: float, back: float, rate: float, step: float = 0.0) -> None:
        peck = f",INCR,{self.text_of((step,))}" if step else ""
        self.lines += ["CYCLE/INIT", f"CYCLE/{'DEEP' if step else 'DRILL'},FEDTO,{self.text_of((depth,))},"
                       f"{self.feed_unit},{self.text_of((rate,))},RAPTO,{self.text_of((clear,))},"
                       f"RTRCTO,{self.text_of((back,))}{peck},DWELL,0"]

    def cycle_off(self) -> None:
        self.lines.append("CYCLE/OFF")

    def end(self) -> None:
        self.lines.append("COOLNT/OFF")

    def close(self) -> None:
        self.lines += ["SETUP/END,1", "FINI"]


@dataclass
class Clt(Spelling):
    """SolidWorks CAM .clt: the table turned by ROTABL in rad, always three numbers, arcs with a word for the sense."""

    table: float = 0.0

    def head(self) -> None:
        self.lines += ["$$ One path, spelt six ways: SolidWorks .clt, without the last operation.", "PARTNO/ SAMPLE",
                       f"UNITS/ {'MM' if self.unit == 'MM' else 'INCHES'} "]

    def begin(self, op: Operation) -> None:
        self.operation, t = op, op.tool
        normal = op.frame.rotation[:, 2]
        tilt = atan2(normal[0], normal[2])
        turns = [f"ROTABL/ {v:.15f},{a}AXIS,TABLE,CCLW" for a, v in zip("ABC", (0.0, tilt, 0.0), strict=True)]
        self.table = tilt
        self.lines += [f"OPFEATSTART/ {op.name}", f"CUTTER/ {self.text_of((t.diameter, 0, 0, 0, 0, t.length))},",
                       f"TLAXIS/ {','.join(f'{v:.6f}' for v in normal + 0.0)} ", f"LOAD/ TOOL,{t.number}",
                       f"SPINDL/ {op.rpm},RPM, CLW", "COOLNT/ FLOOD", *turns, "MOVE_ATTRIB/LEADIN,1"]

    def local(self, point: Triple) -> Floats:
        assert self.operation is not None
        return self.operation.frame.vector_in(point)

    def goto(self, point: Triple, axis: Triple) -> str:
        return f"GOTO/ {self.text_of(self.local(point))}"

    def feed(self, rate: float) -> None:
        self.lines.append(f"FEDRAT/ {self.feed_unit},{self.text_of((rate,))}")

    def circle(self, at_start: Floats, at_end: Floats, normal: Floats, radius: float, end: Floats,
               turns: int) -> None:
        word = "COUNTERCLOCKWISE" if normal @ np.asarray(self.axis, float) > 0 else "CLOCKWISE"
        self.lines += [f"CIRCLE/ {self.text_of(self.local(at_start))},0.0000,0.0000,1.0000,{self.text_of((radius,))},"
                       f"{word}", self.goto(end, self.axis)]

    def cycle(self, depth: float, clear: float, back: float, rate: float, step: float = 0.0) -> None:
        peck = f"PECKING,{self.text_of((step,))},{self.text_of((step,))}," if step else ""
        planes = f"{self.text_of((back,))} {self.text_of((back,))}"
        self.lines += ["CYCLE/ ON ", f"CYCLE/ DRILL,G98,{self.text_of((depth,))},{peck}{self.feed_unit},"
                       f"{self.text_of((rate,))},{self.text_of((clear,))},{planes} DWELL,0.0"]

    def cycle_off(self) -> None:
        self.lines.append("CYCLE/ OFF")

    def end(self) -> None:
        turns = [f"ROTABL/ {v:.15f},{a}AXIS,TABLE,CCLW" for a, v in zip("CBA", (0.0, -self.table, 0.0), strict=True)]
        self.lines += ["COOLNT/ OFF", *turns, "OPFEATEND/"]

    def close(self) -> None:
        self.lines.append("FINI")


@dataclass
class Catia(Spelling):
    """CATIA: six numbers in the axis system of the file, arcs to a line or plane, their ends not repeated."""

    def head(self) -> None:
        self.decimals = 5 if self.unit == "MM" else 6
        rows = [f"$$ {v[0]:11.5f}{v[1]:11.5f}{v[2]:11.5f}{0.0:11.5f}" for v in np.eye(3)]
        self.lines += ["$$ One path, spelt six ways: an APT source of CATIA.", "$$*CATIA0", "$$ Manufacturing Program.1",
                       *rows, "PARTNO SAMPLE"]

    def wide(self, values: Iterable[float]) -> str:
        return ",".join(f"{v + 0.0:11.{self.decimals}f}" for v in self.length(*np.round(np.asarray(list(values)), 9)))

    def begin(self, op: Operation) -> None:
        self.operation, t = op, op.tool
        self.lines += [f"$$ OPERATION NAME : {op.name}", "$$ TOOLCHANGEBEGINNING",
                       f"CUTTER/ {self.text_of((t.diameter, 0, t.diameter / 2, 0), 6)},  0.000000,$",
                       f"         0.000000, {self.text_of((t.length,), 6)}", f"TPRINT/{t.name},{t.name},{t.name}",
                       f"LOADTL/{t.number}", "$$ TOOLCHANGEEND", "MULTAX", f"SPINDL/ {op.rpm:.4f},RPM,CLW", "COOLNT/FLOOD"]

    def goto(self, point: Triple, axis: Triple) -> str:
        return f"GOTO  / {self.wide(point)},{','.join(f'{v + 0.0:9.6f}' for v in axis)}"

    def feed(self, rate: float) -> None:
        self.lines.append(f"FEDRAT/ {self.text_of((rate,), 4)},{self.feed_unit}")

    def circle(self, at_start: Floats, at_end: Floats, normal: Floats, radius: float, end: Floats,
               turns: int) -> None:
        tangent = np.cross(normal, self.position - at_start) / radius
        direction = ",".join(f"{v + 0.0:11.7f}" for v in np.round(tangent, 9))
        self.lines += ["AUTOPS", f"INDIRV/{direction}"]
        r = self.wide((radius,))
        if tuple(self.axis) == UP:
            crossing = "ON,2,INTOF" if turns else "ON"
            self.lines += [f"TLON,GOFWD/ (CIRCLE/{self.wide(at_start)},$", f" {r}),{crossing},(LINE/{self.wide(at_start)},$",
                           f" {self.wide(end)})"]
            return
        up = ",".join(f"{v + 0.0:9.6f}" for v in self.axis)
        plane = f"(PLANE/(POINT/{self.wide(at_start)}),PERPTO,$\n (VECTOR/{up}))"
        self.lines[-2:] = [f"PSIS/{plane}", f"INDIRV/{direction}",
                           f"TLON,GOFWD/(CYLNDR/{self.wide(at_start)},$", f" {up},{r}),ON,(PLANE/PERPTO,{plane},$",
                           f" (POINT/{self.wide(at_start)}),$", f" (POINT/{self.wide(end)}))"]

    def cycle(self, depth: float, clear: float, back: float, rate: float, step: float = 0.0) -> None:
        peck = f"INCR,{self.text_of((step,), 6)}," if step else ""
        self.lines.append(f"CYCLE/{'DEEP' if step else 'DRILL'},DEPTH,{self.text_of((depth,), 6)},{peck}{self.feed_unit},"
                          f"{self.text_of((rate,), 4)},CLEAR,{self.text_of((clear,), 6)},$\n"
                          f"RETURN,{self.text_of((back,), 6)}")

    def cycle_off(self) -> None:
        self.lines.append("CYCLE/OFF")

    def end(self) -> None:
        self.lines.append("COOLNT/OFF")

    def close(self) -> None:
        self.lines += ["REWIND/0", "END"]


@dataclass
class Ncl(Spelling):
    """NCL: fixed columns, six numbers in the part frame, right-hand arcs."""

    def head(self) -> None:
        self.lines += ["$$ One path, spelt six ways: APT source of NCL.", f"{'PARTNO SAMPLE':72}",
                       f"UNITS/{'MM' if self.unit == 'MM' else 'INCHES'}", "MULTAX/ON"]

    def wide(self, values: Iterable[float]) -> str:
        return ",".join(f"{v + 0.0:11.{self.decimals}f}" for v in self.length(*np.round(np.asarray(list(values)), 9)))

    def begin(self, op: Operation) -> None:
        self.operation, t = op, op.tool
        self.lines += [f"PPRINT {op.name}", f"LOADTL/{t.number},LENGTH,{self.wide((t.length,))}",
                       f"CUTTER/{self.wide((t.diameter, 0, t.length))}", f"SPINDL/RPM,{op.rpm:13.4f},CLW", "COOLNT/FLOOD"]

    def goto(self, point: Triple, axis: Triple) -> str:
        return f"GOTO  /{self.wide(point)},{','.join(f'{v + 0.0:10.7f}' for v in axis)}"

    def feed(self, rate: float) -> None:
        self.lines.append(f"FEDRAT/{self.feed_unit},{self.wide((rate,))}")

    def circle(self, at_start: Floats, at_end: Floats, normal: Floats, radius: float, end: Floats,
               turns: int) -> None:
        sense = ",".join(f"{v + 0.0:10.7f}" for v in normal)
        self.lines += [f"CIRCLE/{self.wide(at_start)},{sense},{self.wide((radius,))}", self.goto(end, self.axis)]

    def cycle(self, depth: float, clear: float, back: float, rate: float, step: float = 0.0) -> None:
        peck = f"STEP,{self.wide((step,))}," if step else ""
        self.lines.append(f"CYCLE/{'DEEP' if step else 'DRILL'},FEDTO,{self.wide((depth,))},{self.feed_unit},"
                          f"{self.wide((rate,))},RAPTO,{self.wide((clear,))},{peck}RTRCTO,{self.wide((back,))}")

    def cycle_off(self) -> None:
        self.lines.append("CYCLE/OFF")

    def end(self) -> None:
        self.lines.append("COOLNT/OFF")

    def close(self) -> None:
        self.lines.append("FINI")
