"""A report tab: the tools as the shop's tool room wants them, with how many pieces a tool of 30 minutes of life cuts."""

from postproc.page.tabs import ReportTab, TabTable

LIFE = 30.0 * 60.0
"""s of cutting"""


def blocks(run):
    """Of one machine and control."""
    rows = [[f"T{tool['number']}", tool["name"] or "-", tool["time_s"], float(int(LIFE // tool["time_s"]))]
            for tool in run["tools"] if tool["time_s"]]
    if not rows:
        return ["No program was written, so there is nothing to fetch."]
    return ["Pieces until each tool is changed, at 30 minutes of life.",
            TabTable(("Tool", "Name", "Time, s", "Pieces"), rows)]


TOOL_LIST = ReportTab("Tool room", blocks)
