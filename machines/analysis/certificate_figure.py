"""The boxes of a certificate that a plane through the middle of its region cuts, with the bound proved in each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from machines.certificate import chains
from machines.certificate.search import HALVES
from toolpaths.arrays import Floats
from toolpaths.choices import FigureEnding
from toolpaths.drawing import image

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPANS = ("x_mm", "y_mm", "z_mm", "tilt_rad", "heading_rad")
PLANES = ((0, 1), (0, 2), (1, 2))
"""numbers of the pose to the right and up; the first two are drawn in which the region has a size"""
_SIZE = (13.0, 5.5)


def certificate_figure(content: Mapping[str, Any], ending: FigureEnding) -> bytes:
    """An image file of a certificate's content."""
    if "chain" in content:
        return _chain_figure(content, ending)
    lines = [line.split() for line in content["boxes"]]
    lower, upper = _ends(content, ["" if line[0] == "." else line[0] for line in lines])
    bound = np.array([float(line[1]) for line in lines])

    def fill(sheet: Figure) -> None:
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize
        from matplotlib.patches import Rectangle

        shade = ScalarMappable(Normalize(float(bound.min()), max(float(bound.max()), float(bound.min()) + 1e-9)), "viridis")
        size = upper.max(axis=0) - lower.min(axis=0)
        planes = [plane for plane in PLANES if (size[list(plane)] > 0.0).all()][:2]
        panels = sheet.subplots(1, len(planes), squeeze=False)[0]
        for axes, (right, up) in zip(panels, planes, strict=True):
            middle = 0.5 * (lower.min(axis=0) + upper.max(axis=0))
            others = [i for i in range(5) if i not in (right, up)]
            cut = ((lower <= middle) & (middle <= upper))[:, others].all(axis=1)
            for k in np.flatnonzero(cut):
                sides = upper[k] - lower[k]
                axes.add_patch(Rectangle((lower[k, right], lower[k, up]), sides[right], sides[up], linewidth=0.4,
                                         edgecolor="#222222", facecolor=shade.to_rgba(bound[k])))
            axes.set_xlim(lower[:, right].min(), upper[:, right].max())
            axes.set_ylim(lower[:, up].min(), upper[:, up].max())
            axes.set_xlabel(f"{'xyz'[right]}, mm")
            axes.set_ylabel(f"{'xyz'[up]}, mm")
            axes.set_aspect("equal")
        sheet.colorbar(shade, ax=list(panels), label="distance from direct singularities, at least")

    of, tool = content["region"]["of"], content["region"]["tool_mm"]
    title = f"{content['machine']}: {len(lines)} boxes, of the {of}, tool {tool:g} mm"
    return image(_SIZE, title, fill, ending)


def _chain_figure(content: Mapping[str, Any], ending: FigureEnding) -> bytes:
    """Of a chain: boxes of rotary positions, with the travel that is left to the slides in each."""
    lines = [line.split() for line in content["boxes"]]
    turns = content["region"]["turns_rad"]
    names = [axis["letter"] for axis in content["chain"]["axes"] if axis["rotary"]]
    spans = np.degrees(np.array([turns[name] for name in names]).reshape(-1, 2))
    lower, upper = _halved(spans, chains.HALVES, ["" if line[0] == "." else line[0] for line in lines])
    left = np.array([float(line[3]) for line in lines])

    def fill(sheet: Figure) -> None:
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize
        from matplotlib.patches import Rectangle

        shade, axes = ScalarMappable(Normalize(0.0, max(float(left.max()), 1e-9)), "viridis"), sheet.subplots()
        flat = [np.column_stack([end, np.full((len(lines), 2 - len(names)), v)]) for end, v in ((lower, 0.0), (upper, 1.0))]
        for k in range(len(lines)):
            low, high = flat[0][k], flat[1][k]
            axes.add_patch(Rectangle((low[0], low[1]), high[0] - low[0], high[1] - low[1], linewidth=0.4,
                                     edgecolor="#222222",
                                     facecolor=shade.to_rgba(left[k])))
        axes.set_xlim(flat[0][:, 0].min(), flat[1][:, 0].max())
        axes.set_ylim(flat[0][:, 1].min(), flat[1][:, 1].max())
        axes.set_xlabel("".join(f"{name}, degrees" for name in names[:1]))
        axes.set_ylabel("".join(f"{name}, degrees" for name in names[1:]))
        sheet.colorbar(shade, ax=axes, label="travel left to the slides, mm, at least")

    region = content["region"]
    box = ", ".join(f"{name} {region[f'{name}_mm'][0]:g} to {region[f'{name}_mm'][1]:g}" for name in "xyz")
    return image(_SIZE, f"{content['machine']}: tips {box} mm, tool {region['tool_mm']:g} mm, {len(lines)} boxes", fill,
                 ending)


def _ends(content: Mapping[str, Any], paths: list[str]) -> tuple[Floats, Floats]:
    """(lower, upper), each (N, 5), of boxes by the path of halves to each."""
    return _halved(np.array([content["region"][name] for name in SPANS]), HALVES, paths)


def _halved(spans: Floats, halves: tuple[str, str], paths: list[str]) -> tuple[Floats, Floats]:
    """(lower, upper), each (N, number of `spans`)."""
    lower, upper = np.tile(spans[:, 0], (len(paths), 1)), np.tile(spans[:, 1], (len(paths), 1))
    for k, path in enumerate(paths):
        for letter in path:
            i = halves[0].find(letter)
            end, j = (upper, i) if i >= 0 else (lower, halves[1].index(letter))
            end[k, j] = 0.5 * (lower[k, j] + upper[k, j])
    return lower, upper
