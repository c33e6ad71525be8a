"""Limits of tool axes that installed packages add: `[orientation.criteria.NAME]` of a set-up."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np
from pydantic import ValidationError

from machines.user_model import UserModel
from machines.value_words import AdvisedError, nearest_word
from toolpaths.arrays import Array, Floats
from toolpaths.dataclass import dataclass
from toolpaths.plug_ins import PlugIn, PlugInFault, plug_in, registered, said

CriterionValue = bool | float | str | list[float] | list[str]
"""of a key of a criterion, as a set-up states it"""
GROUP = "postproc.orientation_criteria"


class OrientationCriterion(UserModel, ABC):
    """An angle of the tool axis that must be within bounds in every pass that is re-oriented.

    A package registers a class derived from it in the group `postproc.orientation_criteria`; the fields are the keys of the
    table in the set-up. Directions are unit vectors in the table frame.
    """

    @abstractmethod
    def title(self) -> str:
        """The angle, for people: "angle to the nozzle"."""

    @abstractmethod
    def bounds(self) -> tuple[float, float]:
        """Least and greatest angle, rad."""

    @abstractmethod
    def angles(self, axes: Floats, normal: Floats, travel: Floats) -> Floats:
        """The angle, rad, of M axes (M, 3) at places of a pass, (M, 1) or (M, K); NaN where it is not defined.

        Args:
            normal, travel: surface normal (out of the material) and direction of feed (K, 3); K = 0 where the surface is not
                known
        """


@dataclass(frozen=True)
class Criterion:
    """A criterion as a set-up states it, and the plug-in that it is of."""

    plug_in: PlugIn
    of_package: OrientationCriterion

    def title(self) -> str:
        """The angle and whose it is, for people."""
        return f"{self.of_package.title()} (criterion {self.plug_in})"

    def bounds(self) -> tuple[float, float]:
        """Least and greatest angle, rad.

        Raises:
            PlugInFault: where the package gives none.
        """
        try:
            low, high = (float(value) for value in self.of_package.bounds())
        except (Exception, SystemExit) as fault:  # code of others: whatever it raises
            raise self.fault(said(fault)) from fault
        if not low <= high:
            raise self.fault(f"bounds {low} to {high}")
        return low, high

    def angles(self, axes: Floats, normal: Floats, travel: Floats) -> Floats:
        """As `OrientationCriterion.angles`, checked.

        Raises:
            PlugInFault: where the package gives none.
        """
        try:
            found: Array = np.asarray(self.of_package.angles(axes.copy(), normal.copy(), travel.copy()), dtype=np.float64)
        except (Exception, SystemExit) as fault:  # code of others: whatever it raises
            raise self.fault(said(fault)) from fault
        if found.ndim != 2 or len(found) != len(axes) or found.shape[1] not in (1, len(normal)):
            raise self.fault(f"its angles of {len(axes)} axes at {len(normal)} places have the shape {found.shape}")
        return found

    def fault(self, why: str) -> PlugInFault:
        """What is wrong with the package's code."""
        return PlugInFault(f"the orientation criterion {self.plug_in} gives no angles: {why}",
                           f"correct or uninstall the package {self.plug_in.package}, or take "
                           f"[orientation.criteria.{self.plug_in.name}] out of the set-up")


def criterion_of(name: str, keys: Mapping[str, CriterionValue]) -> Criterion:
    """The criterion of a name with its keys.

    Raises:
        AdvisedError: where no package gives it, its code cannot be used, or a key is wrong.
    """
    known = registered("postproc.orientation_criteria")
    if name not in known:
        some = f"registered are {', '.join(known)}" if known else "no installed package registers one"
        meant = nearest_word(name, list(known))
        raise AdvisedError(f"unknown criterion {name!r}; {some}", (f"did you mean {meant!r}? " if meant else "") +
                           f'install the package that registers it in the entry point group "{GROUP}"')
    try:
        given, model = plug_in("postproc.orientation_criteria", name, known[name])
    except PlugInFault as fault:
        raise AdvisedError(str(fault), fault.hint) from fault
    if not (isinstance(model, type) and issubclass(model, OrientationCriterion)):
        raise AdvisedError(f"the orientation criterion {given} is no OrientationCriterion",
                           f"correct, reinstall or uninstall the package {given.package}")
    try:
        return Criterion(given, model.model_validate(keys))
    except ValidationError as fault:
        first = fault.errors()[0]
        where = ".".join(str(step) for step in first["loc"])
        raise AdvisedError(f"{name}{'.' if where else ''}{where}: {first['msg']}",
                           f"the keys of this criterion are {', '.join(model.model_fields) or 'none'}") from fault
    except (Exception, SystemExit) as fault:  # code of others: whatever it raises
        raise AdvisedError(f"the orientation criterion {given} is not made: {said(fault)}",
                           f"correct, reinstall or uninstall the package {given.package}") from fault


def criteria_of(tables: Mapping[str, Mapping[str, CriterionValue]]) -> tuple[Criterion, ...]:
    """All criteria of a set-up by their names.

    Raises:
        AdvisedError: as `criterion_of`.
    """
    return tuple(criterion_of(name, keys) for name, keys in tables.items())
