"""The robot in three dimensions, moving."""

import json
from typing import Any, ClassVar

import numpy as np
from markupsafe import Markup

from sea_ident.estimation import Model
from sea_ident.motion import FourierSeries
from sea_ident.report.content import Content
from sea_ident.report.scene import build_scene
from sea_ident.report.section import ModelSection
from sea_ident.robot import Robot

SWEEP_SECONDS = 6.0
SWEEP_HALF_RANGE = 0.7


class RobotMotion(ModelSection):
    """A viewer that turns by dragging; the motion is that of the recording, of the excitation, or a sweep."""

    key: ClassVar[str] = "robot_motion"
    title: ClassVar[str] = "The robot along its trajectory"
    needs: ClassVar[str] = "a robot with moving bodies"

    def of_model(self, model: Model, content: Content) -> dict[str, Any] | None:
        """The scene as JSON, and what moves it."""
        robot = model.robot
        motion, periodic = model.excerpt.motion, model.fit.period is not None
        if len(motion) > 1:
            what = "The measured motion of the links" + (", averaged over the periods." if periodic else ".")
        elif content.excitation is not None:
            motion, periodic, what = content.excitation.series.sample(samples=240), True, "The exciting trajectory."
        else:
            motion, periodic, what = _sweep(robot).sample(samples=120), True, "A slow sweep through the joint ranges."
        scene = build_scene(robot, motion.time, motion.q, periodic=periodic)
        # "<" never appears in the script element, so that no text in a URDF can end it
        text = json.dumps(scene.to_dict()).replace("<", "\\u003c")
        return {"scene": Markup(text), "what": what}


def _sweep(robot: Robot) -> FourierSeries:
    lower, upper = robot.limits.lower, robot.limits.upper
    finite = np.isfinite(lower) & np.isfinite(upper) & (upper - lower < 50.0)
    centre = np.where(finite, (np.where(finite, lower, 0) + np.where(finite, upper, 0)) / 2.0, 0.0)
    half = np.where(finite, (np.where(finite, upper, 0) - np.where(finite, lower, 0)) / 2.0, SWEEP_HALF_RANGE)
    amplitude = 0.8 * half * 2.0 * np.pi / SWEEP_SECONDS
    phase = np.arange(robot.n) * 2.0
    return FourierSeries(
        1.0 / SWEEP_SECONDS, centre, (amplitude * np.cos(phase))[:, None], (amplitude * np.sin(phase))[:, None]
    )
