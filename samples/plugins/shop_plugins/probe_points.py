"""A CL format: a table of points as text, a line for each: kind of motion, x, y, z, feed in mm/min; `tool,N,rpm`."""

import math

HEAD = b"probe-points 1"


class ProbePoints:
    like = "generic"

    def recognises(self, head):
        return head.startswith(HEAD)

    def records(self, text):
        yield 1, "UNITS/MM"
        fed = None
        for line, row in enumerate(text.splitlines()[1:], 2):
            cells = [cell.strip() for cell in row.split(",")]
            if cells == [""]:
                continue
            try:
                if cells[0] == "tool":
                    number, rpm = int(cells[1]), float(cells[2])
                    yield line, f"LOADTL/{number}"
                    yield line, f"SPINDL/RPM,{rpm:.10g},CLW"
                    continue
                if cells[0] not in ("rapid", "cut"):
                    raise ValueError(f"{cells[0]!r} is neither tool, rapid nor cut")
                x, y, z, *feed = (float(cell) for cell in cells[1:])
                if not all(map(math.isfinite, (x, y, z, *feed))):
                    raise ValueError("a number that is none")
            except (ValueError, IndexError) as fault:
                raise ValueError(f"line {line}: {fault}") from fault
            if cells[0] == "rapid":
                yield line, "RAPID"
            elif feed and feed != fed:
                yield line, f"FEDRAT/MMPM,{feed[0]!r}"
                fed = feed
            yield line, f"GOTO/{x!r},{y!r},{z!r}"
        yield line, "FINI"
