"""The robot as triangles and poses, for the viewer of the report."""

import base64
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import trimesh

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import RobotError
from sea_ident.robot import Robot, mesh_locator
from sea_ident.robot.geometry import read_geometry

MOST_FACES = 9_000
"""Triangles of a whole robot: enough to recognise it, few enough to draw in a browser and to embed."""

MOST_FRAMES = 240
_PALETTE = ((118, 130, 146), (46, 109, 168), (214, 118, 44), (52, 134, 96), (150, 88, 150), (168, 140, 40))


@dataclass(frozen=True, eq=False)
class Part:
    """One piece of a body.

    Attributes:
        body: index of the moving body, -1 for what is fixed to the world.
        color: (3,) red, green, blue, 0 to 255.
        vertices: (V, 3) in the frame of the body's joint [m].
        faces: (F, 3) indices of vertices.
    """

    body: int
    color: tuple[int, int, int]
    vertices: FloatArray
    faces: IntArray


@dataclass(frozen=True, eq=False)
class Scene:
    """A robot in motion.

    Attributes:
        parts: what is drawn.
        poses: (K, bodies, 3, 4) rotation and position of every body.
        period: time from the first pose to the one after the last [s].
        periodic: whether the motion begins anew after the last pose.
    """

    parts: tuple[Part, ...]
    poses: FloatArray
    period: float
    periodic: bool

    def to_dict(self) -> dict[str, Any]:
        """What the viewer reads."""
        low, high = self.bounds()
        spread = high - low
        # look along the thinnest horizontal direction, a little from the side
        azimuth = (-0.5 if spread[1] <= spread[0] else 0.0) * math.pi + 0.45
        return {
            "frames": len(self.poses),
            "bodies": self.poses.shape[1],
            "period": self.period,
            "periodic": self.periodic,
            "poses": _encode(self.poses.astype("<f4")),
            "centre": [float(v) for v in (low + high) / 2.0],
            "radius": self.radius((low + high) / 2.0),
            "floor": float(low[2]),
            "azimuth": azimuth,
            "parts": [
                {
                    "body": part.body,
                    "color": list(part.color),
                    "vertices": _encode(part.vertices.astype("<f4")),
                    "faces": _encode(part.faces.astype("<u2")),
                }
                for part in self.parts
            ],
        }

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Smallest and largest coordinates (3,) that any part reaches [m]."""
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for points in self._swept():
            low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
        return low, high

    def radius(self, centre: FloatArray) -> float:
        """Largest distance of any part from a point (3,) [m]."""
        return max((float(np.linalg.norm(points - centre, axis=1).max()) for points in self._swept()), default=0.0)

    def _swept(self) -> Iterator[FloatArray]:
        """(M, 3) where the vertices of each part come [m]."""
        for part in self.parts:
            if part.body < 0:
                yield part.vertices
                continue
            pose = self.poses[:, part.body]
            moved = np.einsum("kij,cj->kci", pose[:, :, :3], part.vertices) + pose[:, None, :, 3]
            yield moved.reshape(-1, 3)


def build_scene(robot: Robot, time: FloatArray, q: FloatArray, *, periodic: bool) -> Scene:
    """Triangles and poses of a robot.

    Args:
        robot: the robot.
        time: (N,) [s].
        q: (N, n) link positions [rad] or [m].
        periodic: whether the motion begins anew after the last sample.

    Returns:
        The scene, with at most `MOST_FRAMES` poses. Bodies without a drawable shape get a stick to the next joint.
    """
    step = max(1, math.ceil(len(time) / MOST_FRAMES))
    rows = np.arange(0, len(time), step)
    interval = float(time[-1] - time[0]) / max(len(time) - 1, 1)
    period = interval * (len(time) if periodic else max(len(time) - 1, 1))
    return Scene(tuple(_parts(robot)), _poses(robot, q[rows]), period, periodic)


def _poses(robot: Robot, q: FloatArray) -> FloatArray:
    model = robot.extended_model
    data = model.createData()
    out = np.empty((len(q), len(robot.body_indices), 3, 4))
    for k, x in enumerate(robot.extended_state(q)):
        pin.forwardKinematics(model, data, np.ascontiguousarray(x))
        for i, index in enumerate(robot.body_indices):
            placement = data.oMi[int(index)]
            out[k, i, :, :3], out[k, i, :, 3] = placement.rotation, placement.translation
    return out


def _parts(robot: Robot) -> list[Part]:
    shapes = [shape for shape in _shapes(robot) if len(shape[2])]
    total = sum(len(faces) for *_, faces in shapes)
    share = min(1.0, MOST_FACES / max(total, 1))
    model = robot.model
    parts = []
    for link, color, vertices, faces in shapes:
        frame_id = model.getFrameId(link, pin.FrameType.BODY)
        if frame_id >= model.nframes:
            continue
        frame = model.frames[frame_id]
        body = int(frame.parentJoint) - 1
        if share < 1.0 or len(vertices) > 60_000:
            vertices, faces = simplify(vertices, faces, max(60, int(share * len(faces))))
        placed = vertices @ frame.placement.rotation.T + frame.placement.translation
        parts.append(Part(body, color or _PALETTE[(body + 1) % len(_PALETTE)], placed, faces))
    drawn = {part.body for part in parts}
    missing = [body for body in range(-1, len(robot.bodies)) if body not in drawn]
    return [*parts, *(stick for body in missing for stick in _sticks(robot, body))]


def _shapes(robot: Robot) -> list[tuple[str, tuple[int, int, int] | None, FloatArray, IntArray]]:
    """Link, colour, vertices in the frame of the link, faces."""
    try:
        elements = read_geometry(robot.urdf, robot.source)
    except RobotError:  # a picture is not worth an error: sticks do as well
        return []
    materials = {material.name: material for material in elements.materials if material is not None}
    locate = mesh_locator(robot.source)
    out = []
    for link in elements.links:
        for visual in link.visuals:
            mesh = _mesh(visual.geometry, locate)
            if mesh is None:
                continue
            origin = np.eye(4) if visual.origin is None else visual.origin
            vertices = np.asarray(mesh.vertices) @ origin[:3, :3].T + origin[:3, 3]
            out.append((link.name, _color(visual.material, materials), vertices, np.asarray(mesh.faces, dtype=np.intp)))
    return out


def _mesh(geometry: Any, locate: Callable[[str], Path | None]) -> Any:
    """The surface of a URDF geometry as a trimesh, None where there is none that can be drawn."""
    if geometry.box is not None:
        return trimesh.creation.box(extents=geometry.box.size)
    if geometry.cylinder is not None:
        return trimesh.creation.cylinder(radius=geometry.cylinder.radius, height=geometry.cylinder.length, sections=36)
    if geometry.sphere is not None:
        return trimesh.creation.icosphere(subdivisions=2, radius=geometry.sphere.radius)
    path = None if geometry.mesh is None else locate(geometry.mesh.filename)
    if path is None:
        return None
    try:
        loaded = trimesh.load(path, force="mesh")
    except Exception:  # a picture is not worth an error: what cannot be read is drawn as a stick
        return None
    if not isinstance(loaded, trimesh.Trimesh) or len(loaded.faces) == 0:
        return None
    scale = geometry.mesh.scale
    return loaded if scale is None else trimesh.Trimesh(loaded.vertices * scale, loaded.faces, process=False)


def _color(material: Any, known: dict[str, Any]) -> tuple[int, int, int] | None:
    if material is None:
        return None
    color = material.color or getattr(known.get(material.name), "color", None)
    if color is None:
        return None
    red, green, blue = (int(np.clip(255.0 * float(v), 0, 255)) for v in color.rgba[:3])
    return red, green, blue


def _sticks(robot: Robot, body: int) -> list[Part]:
    """Slender bars from the joint of a body (-1: from the world) to the next joints, or to its centre of mass.

    A slide gets a rail over its range too, or its child would hang in the air.
    """
    model = robot.model
    children = [k for k in range(1, model.njoints) if model.parents[k] == body + 1]
    ends = [model.jointPlacements[k].translation for k in children]
    if not ends and body >= 0:
        ends = [model.inertias[body + 1].lever]
    lines = [(np.zeros(3), end) for end in ends if body >= 0 or np.linalg.norm(end) > 1e-6]
    for i, joint in enumerate(robot.joints):
        k = model.getJointId(joint.name)
        if joint.prismatic and k in children and np.isfinite(robot.limits.upper[i] - robot.limits.lower[i]):
            place = model.jointPlacements[k]
            slide = model.joints[k].createData()
            model.joints[k].calc(slide, np.zeros(model.nq))
            axis = place.rotation @ np.ravel(slide.S)[:3]
            lines.append(tuple(place.translation + axis * at for at in (robot.limits.lower[i], robot.limits.upper[i])))
    return [_bar(body, start, end) for start, end in lines]


def _bar(body: int, start: FloatArray, end: FloatArray) -> Part:
    length = float(np.linalg.norm(end - start))
    if length < 1e-6:
        mesh = trimesh.creation.icosphere(subdivisions=1, radius=0.02)
        mesh.apply_translation(start)
    else:
        mesh = trimesh.creation.cylinder(radius=0.06 * length + 0.004, segment=[start, end], sections=16)
    color = _PALETTE[(body + 1) % len(_PALETTE)]
    return Part(body, color, np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.intp))


def simplify(vertices: FloatArray, faces: IntArray, most: int) -> tuple[FloatArray, IntArray]:
    """A coarser surface: vertices that fall into one cell of a grid become one.

    Args:
        vertices: (V, 3) [m].
        faces: (F, 3) indices.
        most: faces wanted at most.

    Returns:
        Vertices and faces, of the finest grid tried that has at most `most` faces.
    """
    low = vertices.min(axis=0)
    size = float((vertices.max(axis=0) - low).max()) or 1.0
    coarse, fine = 1, 256
    best: tuple[FloatArray, IntArray] = (vertices[:0], faces[:0])
    while coarse <= fine:
        cells = (coarse + fine) // 2
        keys = np.floor((vertices - low) / size * cells).astype(np.int64)
        _, inverse = np.unique(_packed(keys, cells + 1), return_inverse=True)
        joined = inverse[faces]
        solid = (
            (joined[:, 0] != joined[:, 1]) & (joined[:, 1] != joined[:, 2]) & (joined[:, 2] != joined[:, 0])
        )  # fmt: skip
        # A face and its twin have one set of corners.
        _, first = np.unique(_packed(np.sort(joined[solid], axis=1), len(vertices)), return_index=True)
        kept = joined[solid][np.sort(first)]
        if len(kept) <= most:
            count = np.bincount(inverse).astype(float)
            centres = np.stack([np.bincount(inverse, vertices[:, i]) / count for i in range(3)], axis=1)
            used, renamed = np.unique(kept, return_inverse=True)
            best = centres[used], renamed.reshape(-1, 3).astype(np.intp)
            coarse = cells + 1
        else:
            fine = cells - 1
    return best


def _packed(triples: Any, base: int) -> IntArray:
    """(N,) one number for every triple (N, 3) of numbers below a base: far faster to compare."""
    a, b, c = triples.astype(np.int64).T
    return np.asarray((a * base + b) * base + c, dtype=np.int64)


def _encode(values: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
