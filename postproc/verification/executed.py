"""Where the tool of an executed program is, on the machine as it is."""

from __future__ import annotations

from postproc.job.job import Job
from postproc.readback.execution.execute import Motion
from postproc.readback.execution.poses import BlockPoses, poses_before
from toolpaths.arrays import Floats


def executed_poses(job: Job, motion: Motion, lengths: dict[int, float], before: Floats | None = None) -> BlockPoses:
    """Poses of the machine with its errors where the program corrects them; `lengths`: mm by register; `before` (E, 6):
    `BlockPoses.before` of the motion, where it is known."""
    before = poses_before(motion, job.control) if before is None else before
    if job.errors is None or not job.corrects:
        return BlockPoses(job.control, job.kinematics_of, lengths, before)
    from postproc.readback.execution.actual import ActualBlockPoses

    return ActualBlockPoses(job.control, job.kinematics_of, lengths, before, model=job.errors, motion=motion)
