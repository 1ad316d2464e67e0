"""The convex bodies that stand for the links of a robot where collisions are concerned.

Meshes are replaced by their convex hulls and cylinders by prisms around them: what keeps a distance from those keeps it
from the shapes themselves.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import coal
import numpy as np
import pinocchio as pin
import trimesh
from numpy.typing import NDArray

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import ExcitationError, RobotError
from sea_ident.excitation.chain import Chain, Poses
from sea_ident.robot import Robot, mesh_locator
from sea_ident.robot.geometry import read_geometry

_SIDES = 24
_SAMPLES = 200
_ALWAYS = 0.95  # of sampled positions: pairs of links that are in contact in so many always are


@dataclass(frozen=True, eq=False)
class Shape:
    """A convex body: the hull of vertices, or a ball where there is only one.

    Attributes:
        link: link that it belongs to.
        body: index of the moving body that carries it, 0 for the base.
        vertices: (V, 3) in the frame of that body [m].
        ball: radius of a ball, 0 for a hull [m].
    """

    link: str
    body: int
    vertices: FloatArray
    ball: float

    @cached_property
    def centre(self) -> FloatArray:
        """(3,) middle of the box around it, in the frame of its body [m]."""
        middle: FloatArray = 0.5 * (self.vertices.min(axis=0) + self.vertices.max(axis=0))
        return middle

    @cached_property
    def radius(self) -> float:
        """Of a ball about the centre that holds it [m]."""
        return float(np.linalg.norm(self.vertices - self.centre, axis=1).max()) + self.ball

    @cached_property
    def half(self) -> FloatArray:
        """(3,) half the sides of the box around it, in the frame of its body [m]."""
        sides: FloatArray = 0.5 * (self.vertices.max(axis=0) - self.vertices.min(axis=0)) + self.ball
        return sides

    @cached_property
    def reach(self) -> float:
        """Largest distance of its points from the origin of its body [m]."""
        return float(np.linalg.norm(self.vertices, axis=1).max()) + self.ball

    @cached_property
    def geometry(self) -> Any:
        """For coal, in the frame of the body; a ball about its own middle."""
        if self.ball > 0.0:
            return coal.Sphere(self.ball)
        points = coal.StdVec_Vec3s()
        points.extend(list(np.ascontiguousarray(self.vertices)))
        return coal.Convex.convexHull(points, False, "Qt")

    @property
    def shift(self) -> FloatArray:
        """(3,) origin of the geometry in the frame of the body [m]."""
        return self.vertices[0] if self.ball > 0.0 else np.zeros(3)

    def __getstate__(self) -> dict[str, Any]:
        """What travels between processes: coal's bodies do not, they are built again."""
        return {key: value for key, value in self.__dict__.items() if key != "geometry"}


def collision_shapes(robot: Robot) -> tuple[Shape, ...]:
    """The collision geometry of a robot's URDF.

    Raises:
        ExcitationError: there is none, or a mesh is absent or cannot be read.
    """
    try:
        elements = read_geometry(robot.urdf, robot.source)
    except RobotError as error:
        raise ExcitationError(str(error)) from None
    locate = mesh_locator(robot.source)
    shapes = []
    for link in elements.links:
        frame_id = robot.model.getFrameId(link.name, pin.FrameType.BODY)
        if frame_id >= robot.model.nframes:
            continue
        frame = robot.model.frames[frame_id]
        for collision in link.collisions:
            vertices, ball = _outline(collision.geometry, locate, f"{robot.source}: <collision> of link {link.name!r}")
            origin = np.eye(4) if collision.origin is None else np.asarray(collision.origin)
            vertices = vertices @ origin[:3, :3].T + origin[:3, 3]
            placed = vertices @ frame.placement.rotation.T + frame.placement.translation
            shapes.append(_usable(Shape(str(link.name), int(frame.parentJoint), placed, ball)))
    if not shapes:
        raise ExcitationError(f"{robot.source}: no link has a <collision>; add them, or leave self-collision out")
    return tuple(shapes)


def _outline(geometry: Any, locate: Callable[[str], Path | None], where: str) -> tuple[FloatArray, float]:
    """Vertices around a geometry, and the radius of a ball."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    if geometry.box is not None:
        return _checked(corners * np.asarray(geometry.box.size, dtype=np.float64), where), 0.0
    if geometry.sphere is not None:
        return np.zeros((1, 3)), float(_checked(np.array([[float(geometry.sphere.radius)]]), where)[0, 0])
    if geometry.cylinder is not None:
        angle = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        rim = float(geometry.cylinder.radius) / np.cos(np.pi / _SIDES) * np.array([np.cos(angle), np.sin(angle)])
        half = 0.5 * float(geometry.cylinder.length)
        ends = [np.column_stack([rim.T, np.full(_SIDES, height)]) for height in (-half, half)]
        return _checked(np.concatenate(ends), where), 0.0
    if geometry.mesh is None:
        raise ExcitationError(f"{where}: is neither box, cylinder, sphere nor mesh; state one of these")
    name, scale = geometry.mesh.filename, geometry.mesh.scale
    path = locate(name)
    if path is None:
        raise ExcitationError(f"{where}: there is no file {name!r}; put it beside the URDF or into its package")
    try:
        loaded: Any = trimesh.load(path, force="mesh")
        vertices = np.asarray(loaded.vertices, dtype=np.float64)
    except Exception as error:  # the readers of trimesh raise whatever they do
        raise ExcitationError(f"{where}: {path} cannot be read: {error}") from None
    return _hull(_checked(vertices * (1.0 if scale is None else np.asarray(scale)), f"{where}: {path}")), 0.0


def _usable(shape: Shape) -> Shape:
    """The shape; in a box around it where coal cannot hold its hull (a corner with hundreds of neighbours)."""
    try:
        _ = shape.geometry
    except RuntimeError:
        back, size = trimesh.bounds.oriented_bounds(shape.vertices)  # type: ignore[no-untyped-call]
        box = trimesh.creation.box(extents=size, transform=np.linalg.inv(back))
        return replace(shape, vertices=np.asarray(box.vertices, dtype=np.float64))
    return shape


def _checked(vertices: FloatArray, where: str) -> FloatArray:
    if len(vertices) == 0 or not np.all(np.isfinite(vertices)):
        raise ExcitationError(f"{where}: is empty or holds numbers that are not finite")
    return vertices


def _hull(vertices: FloatArray) -> FloatArray:
    """Corners of the convex hull; of a box around vertices that lie in a plane."""
    try:
        return np.asarray(trimesh.convex.convex_hull(vertices).vertices, dtype=np.float64)
    except Exception:  # flat
        low, high = vertices.min(axis=0) - 1e-4, vertices.max(axis=0) + 1e-4
        return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


@dataclass(frozen=True)
class Pair:
    """Two shapes, by index, and the distance that they have to keep [m]."""

    first: int
    second: int
    distance: float


def watched_pairs(
    robot: Robot,
    chain: Chain,
    shapes: Sequence[Shape],
    distance: float,
    ignored: Sequence[tuple[str, str]],
    notes: list[str],
) -> tuple[Pair, ...]:
    """Pairs of shapes that have to keep a distance.

    Left out, as in an SRDF, are shapes on one body, those of neighbouring bodies, those that the user ignores, and
    links that are always in contact: at the neutral position and, of 200 random positions inside the limits, in at
    least 95 %. Links with one body between them that are always nearer than the distance, but not in contact, have to
    stay out of contact only.

    Args:
        robot: the robot.
        chain: its tree.
        shapes: all of them.
        distance: safety distance [m].
        ignored: pairs of links that may come nearer.
        notes: what is left out is added here.

    Returns:
        The pairs.
    """
    unwatched = {frozenset(pair) for pair in ignored}
    links = {shape.link for shape in shapes}
    for name in sorted({name for pair in ignored for name in pair} - links):
        notes.append(f"self-collision: the link {name!r} of an ignored pair has no <collision>")
    adjacent: list[frozenset[str]] = []
    pairs = []
    for i, k in combinations(range(len(shapes)), 2):
        a, b = shapes[i], shapes[k]
        if a.body == b.body or a.link == b.link:
            continue
        if chain.parents[a.body] == b.body or chain.parents[b.body] == a.body:
            adjacent.append(frozenset((a.link, b.link)))
        elif frozenset((a.link, b.link)) not in unwatched:
            pairs.append(Pair(i, k, distance))
    low, high = np.clip(robot.limits.lower, -np.pi, np.pi), np.clip(robot.limits.upper, -np.pi, np.pi)
    neutral = np.clip(np.zeros(robot.n), low, high)
    drawn = np.random.default_rng(0).uniform(low, high, (_SAMPLES, robot.n))
    apart, _ = separations(shapes, pairs, chain.at(np.vstack([neutral, drawn])), 2.0 * distance + 1e-3)
    by_links: dict[frozenset[str], list[int]] = {}
    for index, pair in enumerate(pairs):
        by_links.setdefault(_links(shapes, pair), []).append(index)
    touching, near = (
        {names for names, members in by_links.items() if _always(apart[:, members].min(axis=1) <= least)}
        for least in (0.0, distance)
    )
    near &= {_links(shapes, pair) for pair in pairs if _one_between(chain, shapes, pair)}
    _say("self-collision: not watched, because they are neighbours", adjacent, notes)
    _say("self-collision: not watched, because they are in contact in nearly all positions", touching, notes)
    _say(
        f"self-collision: watched for contact only, because they are within {distance:g} m in nearly all positions",
        near - touching,
        notes,
    )
    bare = [body for body in robot.bodies if body not in links]
    if bare:
        notes.append(f"self-collision: links without <collision> take no part: {', '.join(bare)}")
    return tuple(
        replace(pair, distance=0.0) if _links(shapes, pair) in near else pair
        for pair in pairs
        if _links(shapes, pair) not in touching
    )


def _links(shapes: Sequence[Shape], pair: Pair) -> frozenset[str]:
    return frozenset((shapes[pair.first].link, shapes[pair.second].link))


def _one_between(chain: Chain, shapes: Sequence[Shape], pair: Pair) -> bool:
    """Whether one body, or the joint on which both hang, is between two bodies."""
    a, b = shapes[pair.first].body, shapes[pair.second].body
    return int(np.count_nonzero(chain.carries[:, a] != chain.carries[:, b])) == 2


def _always(happens: NDArray[np.bool_]) -> bool:
    """Whether something happens at the neutral position, which comes first, and at nearly all others."""
    return bool(happens[0]) and float(np.mean(happens[1:])) >= _ALWAYS


def _say(what: str, pairs: Iterable[frozenset[str]], notes: list[str]) -> None:
    listed = sorted({" - ".join(sorted(pair)) for pair in pairs})
    if listed:
        notes.append(f"{what}: {', '.join(listed)}")


def _at_least(shapes: Sequence[Shape], first: IntArray, second: IntArray, poses: Poses) -> FloatArray:
    """(r, M) lower bounds of distances: gaps between balls, and between boxes along the line of their centres."""
    bodies = np.array([shape.body for shape in shapes])
    centres = np.array([poses.points(shape.body, shape.centre) for shape in shapes])
    radius = np.array([shape.radius for shape in shapes])
    halves = np.array([shape.half for shape in shapes])
    between = centres[second] - centres[first]
    length = np.linalg.norm(between, axis=2)
    along = between / np.maximum(length, 1e-12)[:, :, None]
    widths = np.zeros((2, *length.shape))
    for width, side in zip(widths, (first, second), strict=True):
        local = np.einsum("pmij,pmi->pmj", poses.rotations[bodies[side]], along)
        width[:] = np.minimum(np.einsum("pmj,pj->pm", np.abs(local), halves[side]), radius[side][:, None])
    bound: FloatArray = length - widths[0] - widths[1]
    return bound


def separations(
    shapes: Sequence[Shape],
    pairs: Sequence[Pair],
    poses: Poses,
    most: float,
    wanted: FloatArray | None = None,
) -> tuple[FloatArray, dict[tuple[int, int], FloatArray]]:
    """Distances between shapes.

    Args:
        shapes: all of them.
        pairs: which ones.
        poses: of the bodies at M samples.
        most: larger distances may be given as this one [m].
        wanted: (M, r) which are asked for; the others are given as `most`.

    Returns:
        (M, r) distances, below 0 how deep shapes overlap, at most `most` [m], and, by sample and pair of those that
        are less, the nearest points (3,) in the frame of the root and the direction (3,) from the first to the second.
    """
    samples = poses.positions.shape[1]
    found = np.full((samples, len(pairs)), most)
    first, second = (np.array([getattr(p, side) for p in pairs], dtype=np.intp) for side in ("first", "second"))
    apart = _at_least(shapes, first, second, poses)
    near = (apart < most).T & (np.ones_like(found, dtype=bool) if wanted is None else wanted.astype(bool))
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    points: dict[tuple[int, int], FloatArray] = {}
    for m in np.flatnonzero(near.any(axis=1)):
        placed: dict[int, Any] = {}
        for k in np.flatnonzero(near[m]):
            sides = (int(first[k]), int(second[k]))
            for i in sides:
                if i not in placed:
                    shape = shapes[i]
                    rotation = poses.rotations[shape.body, m]
                    placed[i] = coal.Transform3s(rotation, poses.positions[shape.body, m] + rotation @ shape.shift)
            a, b = sides
            result.clear()
            distance = coal.distance(shapes[a].geometry, placed[a], shapes[b].geometry, placed[b], request, result)
            if distance < most:
                found[m, k] = distance
                nearest = np.array([result.getNearestPoint1(), result.getNearestPoint2(), result.normal])
                points[int(m), int(k)] = nearest
    return found, points
