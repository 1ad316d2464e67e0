"""Limits on where the robot is: points on one side of a plane, links apart from each other.

Both say that a room, a distance in metres, stays positive. It changes no faster than the points that it is measured
between move against each other: the speed of every joint times the lever of those points about its axis.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray, IntArray
from sea_ident.exceptions import ExcitationError
from sea_ident.excitation.chain import Chain
from sea_ident.excitation.collision_shapes import Pair, Shape, collision_shapes, separations, watched_pairs
from sea_ident.excitation.limit_checks import as_numbers
from sea_ident.robot import HalfSpace, Limits, Robot

ROUNDING: float = 1e-5
"""What the distance of two hulls is trusted to [m]; it is taken off every room between links."""
_REACH = 0.1  # of the size of the robot: rooms between links beyond it are not told apart


@dataclass(frozen=True, eq=False)
class Plane:
    """A half-space as it is computed with.

    Attributes:
        body: that carries the point, 0 for the base.
        point: (3,) in its frame [m].
        normal: (3,) unit normal, out of what is allowed.
        offset: of the plane [m].
    """

    body: int
    point: FloatArray
    normal: FloatArray
    offset: float


@dataclass(frozen=True, eq=False)
class SpaceLimits:
    """room >= 0 for r planes and pairs of links.

    Attributes:
        chain: the tree of the robot.
        names: (r,) names of the limits, planes first.
        planes: the half-spaces.
        shapes: convex bodies of all links.
        pairs: pairs of shapes that have to keep a distance.
        members: index of the limit that each pair belongs to: one per pair of links.
        least: (r,) the least distance of links; for planes NaN [m].
        reach: larger rooms between links count as this one [m].
        size: of the robot [m].
    """

    chain: Chain
    names: tuple[str, ...]
    planes: tuple[Plane, ...]
    shapes: tuple[Shape, ...]
    pairs: tuple[Pair, ...]
    members: IntArray
    least: FloatArray
    reach: float
    size: float

    def __len__(self) -> int:
        return len(self.names)

    @property
    def lower(self) -> FloatArray:
        """(r,) lowest values as they are reported [m]."""
        return np.where(np.isnan(self.least), -np.inf, self.least)

    @property
    def upper(self) -> FloatArray:
        """(r,) highest values as they are reported [m]."""
        offsets = [plane.offset for plane in self.planes]
        return np.concatenate([offsets, np.full(len(self) - len(offsets), np.inf)])

    def rooms(self, q: FloatArray, wanted: FloatArray | None = None) -> FloatArray:
        """Distances to the limits.

        Args:
            q: (M, n) positions.
            wanted: (M, r) which are asked for; all by default.

        Returns:
            (M, r) [m]; for links at most `reach`, and that where it was not asked for.
        """
        return self._rooms(q, wanted, slopes=False)[0]

    def slopes(self, q: FloatArray) -> FloatArray:
        """(M, r, n) derivatives of the rooms by q; zero where a room counts as `reach`."""
        return self._rooms(q, None, slopes=True)[1]

    def _rooms(self, q: FloatArray, wanted: FloatArray | None, *, slopes: bool) -> tuple[FloatArray, FloatArray]:
        samples, planes = len(q), len(self.planes)
        poses = self.chain.at(q)
        rooms = np.full((samples, len(self)), self.reach)
        by_tree = np.zeros((samples, len(self), len(self.chain.parents))) if slopes else np.zeros((0, 0, 0))
        for k, plane in enumerate(self.planes):
            points = poses.points(plane.body, plane.point)
            rooms[:, k] = plane.offset - points @ plane.normal
            if slopes:
                out = np.broadcast_to(-plane.normal, (samples, 3))
                by_tree[:, k] = self.chain.slopes(poses, plane.body, points, out)
        if self.pairs:
            most = float(np.nanmax(self.least)) + self.reach + ROUNDING
            asked = None if wanted is None else wanted[:, self.members]
            apart, nearest = separations(self.shapes, self.pairs, poses, most, asked)
            apart = apart - self.least[self.members] - ROUNDING
            np.minimum.at(rooms.T, self.members, apart.T)  # which is at most the reach
            if slopes:
                self._pair_slopes(q, apart, rooms, nearest, by_tree)
        if wanted is not None:
            rooms[:, :planes][~wanted[:, :planes].astype(bool)] = self.reach
        return rooms, by_tree @ self.chain.map if slopes else by_tree

    def _pair_slopes(
        self,
        q: FloatArray,
        apart: FloatArray,
        rooms: FloatArray,
        nearest: dict[tuple[int, int], FloatArray],
        by_tree: FloatArray,
    ) -> None:
        """Write the derivatives of the rooms of links into (M, r, J + 1)."""
        poses = self.chain.at(q)
        for k, pair in enumerate(self.pairs):
            limit = int(self.members[k])
            rows = [m for m in range(len(q)) if (m, k) in nearest and apart[m, k] <= rooms[m, limit]]
            if not rows:
                continue
            first, second, direction = np.nan_to_num([nearest[m, k] for m in rows]).swapaxes(0, 1)
            there = type(poses)(poses.rotations[:, rows], poses.positions[:, rows], poses.axes[:, rows])
            one = self.chain.slopes(there, self.shapes[pair.first].body, first, direction)
            other = self.chain.slopes(there, self.shapes[pair.second].body, second, direction)
            by_tree[rows, limit] = other - one

    def levers(self, largest: FloatArray) -> FloatArray:
        """How fast the rooms change at most with every coordinate of the tree.

        Args:
            largest: (n,) bounds on |q| [rad] or [m].

        Returns:
            (r, J + 1) [m/rad] or [-].
        """
        chain, travel = self.chain, self.chain.travel(largest)
        found = np.zeros((len(self), len(chain.parents)))
        for k, plane in enumerate(self.planes):
            found[k] = chain.levers(plane.body, plane.point, 0.0, travel)
        for k, pair in enumerate(self.pairs):
            sides = self.shapes[pair.first], self.shapes[pair.second]
            for shape, other in (sides, sides[::-1]):
                # about the axis of a joint between two nearest points both have the same speed along their distance
                outward = chain.levers(shape.body, shape.centre, shape.radius, travel)
                for j in np.flatnonzero(chain.carries[:, shape.body] & ~chain.carries[:, other.body]):
                    lever = float(outward[j])
                    if not chain.slides[j]:
                        lever = min(lever, chain.levers_behind(int(j), other.body, other.reach, travel))
                    limit = self.members[k]
                    found[limit, j] = max(found[limit, j], lever)
        return found

    def describe(self, limit: int, room: float) -> str:
        """Say how a limit stands, with numbers."""
        if limit < len(self.planes):
            plane = self.planes[limit]
            normal = np.round(plane.normal, 4).tolist()
            along = plane.offset - room
            return f"{self.names[limit]}: n . p = {along:.4g} m with n = {normal}, at most {plane.offset:.4g} m"
        least = float(self.least[limit])
        return f"{self.names[limit]}: {room + least:.4g} m apart, at least {least:.4g} m"


def space_limits(robot: Robot, limits: Limits, notes: list[str]) -> SpaceLimits:
    """The half-spaces and the self-collision of a robot's limits.

    Args:
        robot: the robot.
        limits: its limits.
        notes: pairs of links that are left out are added here.

    Raises:
        ExcitationError: an unknown link, a half-space that is no such, or collision geometry that cannot be used.
    """
    chain = Chain.of(robot)
    planes = [_plane(robot, chain, half_space) for half_space in limits.half_spaces]
    names = _distinct([f"{half.name} ({half.link})" for half in limits.half_spaces])
    shapes: tuple[Shape, ...] = ()
    pairs: tuple[Pair, ...] = ()
    members: list[int] = []
    least = np.full(len(planes), np.nan)
    wish = limits.self_collision
    if wish is not None:
        if not (np.isfinite(wish.distance) and wish.distance >= 0.0):
            raise ExcitationError(f"the self-collision distance is {wish.distance} m; give a number of at least 0")
        known = {frame.name for frame in robot.model.frames}
        unknown = sorted({name for pair in wish.ignored for name in pair} - known)
        if unknown:
            raise ExcitationError(f"self-collision: {robot.name} has no link {', '.join(map(repr, unknown))} to ignore")
        shapes = collision_shapes(robot)
        pairs = watched_pairs(robot, chain, shapes, wish.distance, wish.ignored, notes)
        labels = [" - ".join((shapes[pair.first].link, shapes[pair.second].link)) for pair in pairs]
        order = list(dict.fromkeys(labels))
        members = [len(planes) + order.index(label) for label in labels]
        names += [f"{label}.distance" for label in order]
        by_label = {label: pair.distance for label, pair in zip(labels, pairs, strict=True)}
        least = np.append(least, [by_label[label] for label in order])
    size = float(np.linalg.norm(chain.translations, axis=1).sum()) + max((s.radius for s in shapes), default=0.0)
    size = max(size, 0.1)
    return SpaceLimits(
        chain,
        tuple(names),
        tuple(planes),
        shapes,
        pairs,
        np.array(members, dtype=np.intp),
        least,
        _REACH * size,
        size,
    )


def _distinct(names: Sequence[str]) -> list[str]:
    """Names with numbers where one occurs again."""
    found: list[str] = []
    for name in names:
        count = sum(other == name or other.startswith(f"{name} #") for other in found)
        found.append(name if count == 0 else f"{name} #{count + 1}")
    return found


def _plane(robot: Robot, chain: Chain, half: HalfSpace) -> Plane:
    where = f"half-space {half.name!r}"
    frame_id = robot.model.getFrameId(half.link, pin.FrameType.BODY)
    if frame_id >= robot.model.nframes:
        links = ", ".join(frame.name for frame in robot.model.frames if frame.type == pin.FrameType.BODY)
        raise ExcitationError(f"{where}: {robot.name} has no link {half.link!r}; its links: {links}")
    normal, point = as_numbers(f"{where}: its normal", half.normal), as_numbers(f"{where}: its point", half.point)
    if normal.shape != (3,) or point.shape != (3,) or not np.all(np.isfinite([*normal, *point, half.offset])):
        raise ExcitationError(f"{where}: normal and point must be three finite numbers each, the offset one")
    length = float(np.linalg.norm(normal))
    if length == 0.0:
        raise ExcitationError(f"{where}: its normal is zero; give the direction that points out of what is allowed")
    frame = robot.model.frames[frame_id]
    body = int(frame.parentJoint)
    placed = frame.placement.rotation @ point + frame.placement.translation
    plane = Plane(body, placed, normal / length, half.offset / length)
    if not np.any(chain.carries[:, body]):
        room = plane.offset - float(plane.normal @ placed)
        raise ExcitationError(
            f"{where}: the link {half.link!r} never moves; its point is {abs(room):.4g} m "
            f"{'inside' if room >= 0.0 else 'outside'}. Name a link that moves, or leave the limit out"
        )
    return plane
