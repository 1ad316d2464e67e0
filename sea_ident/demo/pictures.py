"""Pictures like the paper's figures 1(a), 1(b) and 3, and the leg from the side."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from scipy.spatial import ConvexHull

from sea_ident._typing import FloatArray
from sea_ident.atomic import atomic_file
from sea_ident.motion import FourierSeries, Motion
from sea_ident.processing import ProcessedRecording
from sea_ident.report.scene import build_scene
from sea_ident.robot import Robot

_BLUE, _RED, _GREEN, _INK = "#0b6fc2", "#c8340c", "#12836a", "#22262b"
_JOINT_COLORS = (_BLUE, _GREEN, _RED, "#a8478f", "#8a6d00", "#5a58c7")


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def _save(figure: Figure, path: Path) -> None:
    with atomic_file(path) as temporary:
        figure.savefig(temporary, dpi=160)


def torque_of_periods(processed: ProcessedRecording, joint: str, path: Path) -> None:
    """Figure 1(a): the torque of every period and their mean, over half a period."""
    i = processed.joint_names.index(joint)
    half = slice(0, processed.samples // 2)
    time = processed.motion.time[half] - processed.motion.time[0]
    figure = _figure(7.0, 3.4)
    axes = figure.add_subplot()
    axes.plot(time, processed.period_tau_motor[:, half, i].T, color=_BLUE, lw=0.5, alpha=0.35)
    axes.plot([], [], color=_BLUE, lw=1, label=f"{processed.periods} periods")
    axes.plot(time, processed.tau_motor[half, i], color=_RED, lw=1.4, label="mean")
    axes.set(xlabel="time [s]", ylabel="motor torque [N m]", title=f"Motor torque of the {joint}")
    axes.legend(frameon=False)
    axes.margins(x=0)
    _save(figure, path)


def variance_and_velocity(processed: ProcessedRecording, joint: str, path: Path) -> None:
    """Figure 1(b): motor velocity and torque variance: the torque scatters where the motor turns round."""
    i = processed.joint_names.index(joint)
    half = slice(0, processed.samples // 2)
    time = processed.motion.time[half] - processed.motion.time[0]
    velocity = processed.motion.dtheta[half, i]
    figure = _figure(7.0, 3.4)
    axes = figure.add_subplot()
    axes.axhline(0.0, color="0.75", lw=0.8)
    turns = time[:-1][np.sign(velocity[:-1]) != np.sign(velocity[1:])]
    for turn in turns:
        axes.axvline(turn, color="0.85", lw=0.8)
    axes.plot(time, velocity, color=_BLUE, lw=1.4)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("motor velocity [rad/s]", color=_BLUE)
    other = axes.twinx()
    other.plot(time, processed.raw_tau_variance[half, i], color=_GREEN, lw=0.6, alpha=0.5)
    other.plot(time, processed.tau_variance[half, i], color=_GREEN, lw=1.6)
    other.set_ylabel("torque variance [(N m)\N{SUPERSCRIPT TWO}]", color=_GREEN)
    other.set_yscale("log")
    axes.set_title(f"Motor velocity and torque variance of the {joint}")
    axes.margins(x=0)
    _save(figure, path)


def angles(processed: ProcessedRecording, planned: FourierSeries, path: Path) -> None:
    """Figure 3: planned angles, mean motor angles and mean link angles of one period."""
    motion = processed.motion
    time = motion.time - motion.time[0]
    figure = _figure(8.0, 4.4)
    axes = figure.add_subplot()
    reference = planned.evaluate(motion.time)
    for i, name in enumerate(processed.joint_names):
        color = _JOINT_COLORS[i % len(_JOINT_COLORS)]
        axes.plot(time, motion.theta[:, i], color=color, lw=1.8, label=f"{name}, motor")
        axes.plot(time, motion.q[:, i], color=color, lw=1.3, ls=(0, (4, 2)), label=f"{name}, link")
        # the motors follow so closely that it would be hidden beneath theirs
        axes.plot(time, reference[:, i], color=_INK, lw=0.9, ls=":")
    axes.plot([], [], color=_INK, lw=0.9, ls=":", label="planned")
    axes.set(xlabel="time [s]", ylabel="angle [rad]", title="Planned, motor and link angles")
    axes.legend(frameon=False, ncol=4, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.14))
    axes.margins(x=0)
    _save(figure, path)


def side_view(robot: Robot, motion: Motion, path: Path, *, shown: int = 9) -> None:
    """The robot seen along y at moments of a trajectory, the last in colour, with the path of its last body."""
    scene = build_scene(robot, motion.time, motion.q, periodic=True)
    figure = _figure(5.0, 6.2)
    axes = figure.add_subplot()
    moments = np.linspace(0, len(scene.poses) - 1, shown).astype(int)
    for order, k in enumerate(moments):
        now = order == shown - 1
        for part in scene.parts:
            if part.body < 0 and not now:
                continue
            vertices = part.vertices
            if part.body >= 0:
                pose = scene.poses[k, part.body]
                vertices = vertices @ pose[:, :3].T + pose[:, 3]
            color = tuple(c / 255.0 for c in part.color) if now else "#8fa3b8"
            outline = PolyCollection(
                [_outline(vertices[:, [0, 2]])],
                facecolors=[color],
                edgecolors="white" if now else "none",
                linewidths=0.4,
                alpha=1.0 if now else 0.16,
                zorder=order,
            )
            axes.add_collection(outline)
    last = scene.poses.shape[1] - 1
    tip = np.mean([part.vertices.mean(axis=0) for part in scene.parts if part.body == last], axis=0)
    path_of_tip = scene.poses[:, last, :, :3] @ tip + scene.poses[:, last, :, 3]
    axes.plot(path_of_tip[:, 0], path_of_tip[:, 2], color=_RED, lw=1.2, zorder=shown + 1)
    axes.set(xlabel="x [m]", ylabel="z [m]", title=f"{robot.name} along its trajectory", aspect="equal")
    axes.autoscale_view()
    axes.margins(0.06)
    _save(figure, path)


def _outline(points: FloatArray) -> FloatArray:
    """(H, 2) convex outline of (V, 2) points."""
    hull: FloatArray = points[ConvexHull(points).vertices]
    return hull
