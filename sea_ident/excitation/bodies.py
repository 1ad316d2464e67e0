"""Columns of rigid bodies and their derivatives, for many samples at once.

`build_regressor` is the reference for the columns themselves. An excitation needs their derivatives with respect to
position, velocity and acceleration too, some hundred times over a whole period: here they are written as a few matrix
products over all samples, with no loop over samples.

In the frame of body i, with J its Jacobian (6, m) and z = (d, alpha, w w') its classical acceleration less gravity,
its angular acceleration and the products of its angular velocity, the wrench that each of the ten parameters needs is
linear in z. So is its torque: ``Y = J' F z`` with a constant F, and

    dY/ds = J' F dz/ds + (dJ/ds)' F z

where a column of J upstream of joint k turns with it: dJ_j/dq_k = J_j x J_k for j < k.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from sea_ident._typing import FloatArray, IntArray

# row and column of the six products in w w', in the order of Pinocchio's moments of inertia
_ROW = np.array([0, 0, 1, 0, 1, 2])
_COLUMN = np.array([0, 1, 1, 2, 2, 2])


def _skew(x: FloatArray) -> FloatArray:
    return np.array([[0.0, -x[2], x[1]], [x[2], 0.0, -x[0]], [-x[1], x[0], 0.0]])


def _wrench_tensor() -> FloatArray:
    """(6, 10, 12) F: wrench (force, moment) of each parameter, linear in z = (d, alpha, products of w)."""
    tensor = np.zeros((6, 10, 12))
    unit = np.eye(3)
    tensor[:3, 0, :3] = unit  # m d
    for k in range(3):
        tensor[3:, 1 + k, :3] = _skew(unit[k])  # h x d
        tensor[:3, 1 + k, 3:6] = -_skew(unit[k])  # alpha x h
    for r in range(6):
        inertia = np.zeros((3, 3))
        inertia[_ROW[r], _COLUMN[r]] = inertia[_COLUMN[r], _ROW[r]] = 1.0
        tensor[3:, 4 + r, 3:6] = inertia  # I alpha
        # w x (I w) = products: sum_ab e_a x (I e_b) w_a w_b
        for s in range(6):
            a, b = _ROW[s], _COLUMN[s]
            term = np.cross(unit[a], inertia[:, b])
            if a != b:
                term = term + np.cross(unit[b], inertia[:, a])
            tensor[3:, 4 + r, 6 + s] = term
    for k in range(3):  # w x (w x h) = w (w . h) - h w^2
        for s in range(6):
            a, b = _ROW[s], _COLUMN[s]
            term = unit[a] * unit[k][b] - unit[k] * unit[a][b]
            if a != b:
                term = term + unit[b] * unit[k][a] - unit[k] * unit[b][a]
            tensor[:3, 1 + k, 6 + s] = term
    return tensor


_WRENCH = _wrench_tensor()


def _cross(x: FloatArray, y: FloatArray, out: FloatArray | None = None) -> FloatArray:
    """Cross product along axis 0, broadcasting over the others."""
    first = x[1] * y[2]
    if out is None:
        out = np.empty((3, *first.shape))
    np.subtract(first, x[2] * y[1], out=out[0])
    np.subtract(x[2] * y[0], x[0] * y[2], out=out[1])
    np.subtract(x[0] * y[1], x[1] * y[0], out=out[2])
    return out


def _motion_cross(x: FloatArray, y: FloatArray) -> FloatArray:
    """Cross product of spatial motions (linear, angular) along axis 0, broadcasting over the others."""
    linear = _cross(x[3:], y[:3])
    out = np.empty((6, *linear.shape[1:]))
    np.add(linear, _cross(x[:3], y[3:]), out=out[:3])
    _cross(x[3:], y[3:], out=out[3:])
    return out


def _running_sum(terms: FloatArray) -> FloatArray:
    """Sums along axis 1, in place (`numpy.cumsum` is several times slower where that axis is short)."""
    for k in range(1, terms.shape[1]):
        terms[:, k] += terms[:, k - 1]
    return terms


@dataclass(frozen=True, eq=False)
class BodyColumns:
    """Chosen inertial columns of a Pinocchio model whose joints all have one coordinate.

    Attributes:
        parents: (J,) parent of each joint.
        rotations: (J, 3, 3) placement of each joint in its parent.
        translations: (J, 3) placement of each joint in its parent [m].
        axes: (J, 6) motion subspace of each joint in its own frame (linear, angular).
        paths: joints from the root to each joint, itself included.
        gravity: (3,) [m/s2].
        tensors: (6, r, 12) wrench of each body's columns, linear in z.
        places: (r,) column to which each of these adds.
        count: number of columns p.
    """

    parents: tuple[int, ...]
    rotations: FloatArray
    translations: FloatArray
    axes: FloatArray
    paths: tuple[IntArray, ...]
    gravity: FloatArray
    tensors: tuple[FloatArray, ...]
    places: tuple[IntArray, ...]
    count: int

    @staticmethod
    def of(model: pin.Model, parameters: IntArray) -> "BodyColumns":
        """Choose columns.

        Args:
            model: the model; every joint has one coordinate.
            parameters: (p,) columns, ``10 * (joint - 1) + parameter`` as in `computeJointTorqueRegressor`.

        Returns:
            The columns.
        """
        bodies = parameters // 10 + 1
        tensors = [_WRENCH[:, parameters[bodies == k] % 10] for k in range(model.njoints)]
        places = [np.flatnonzero(bodies == k) for k in range(model.njoints)]
        return BodyColumns._build(model, tensors, places, len(parameters))

    @staticmethod
    def torque(model: pin.Model, inertial: FloatArray | None = None) -> "BodyColumns":
        """The torque of a model with standard inertial parameters (10 b,), or with its own, as a single column."""
        if inertial is None:
            inertial = np.concatenate([model.inertias[k].toDynamicParameters() for k in range(1, model.njoints)])
        tensors = [np.zeros((6, 0, 12))]
        for values in inertial.reshape(-1, 10):
            tensors.append(np.einsum("abc,b->ac", _WRENCH, values)[:, None, :])
        places = [np.zeros(tensor.shape[1], dtype=np.intp) for tensor in tensors]
        return BodyColumns._build(model, tensors, places, 1)

    @staticmethod
    def _build(
        model: pin.Model, tensors: Sequence[FloatArray], places: Sequence[IntArray], count: int
    ) -> "BodyColumns":
        data = model.createData()
        pin.computeJointJacobians(model, data, np.zeros(model.nq))
        axes = np.zeros((model.njoints, 6))
        paths: list[IntArray] = [np.zeros(0, dtype=np.intp)]
        for k in range(1, model.njoints):
            jacobian = pin.getJointJacobian(model, data, k, pin.ReferenceFrame.LOCAL).reshape(6, model.nv)
            axes[k] = jacobian[:, model.joints[k].idx_v]
            paths.append(np.append(paths[model.parents[k]], k))
        return BodyColumns(
            parents=tuple(int(parent) for parent in model.parents),
            rotations=np.array([placement.rotation for placement in model.jointPlacements]),
            translations=np.array([placement.translation for placement in model.jointPlacements]),
            axes=axes,
            paths=tuple(paths),
            gravity=np.array(model.gravity.linear),
            tensors=tuple(tensors),
            places=tuple(places),
            count=count,
        )

    @property
    def joints(self) -> int:
        """Number of coordinates."""
        return len(self.parents) - 1

    def at(self, x: FloatArray, v: FloatArray, a: FloatArray) -> "BodyMotion":
        """Kinematics of a motion.

        Args:
            x: (J, N) positions.
            v: (J, N) velocities.
            a: (J, N) accelerations.

        Returns:
            What columns and derivatives are computed from.
        """
        samples = x.shape[1]
        bodies: dict[int, _Body] = {}
        known: dict[int, tuple[FloatArray | None, FloatArray]] = {
            0: (None, np.broadcast_to(-self.gravity[:, None], (3, samples)))
        }
        carrying = {int(k) for body in range(1, self.joints + 1) if len(self.places[body]) for k in self.paths[body]}
        for body in range(1, self.joints + 1):
            if body not in carrying:
                continue
            jacobian, weight = self._step(body, x[body - 1], *known[self.parents[body]])
            known[body] = jacobian, weight
            if len(self.places[body]):
                rows = self.paths[body] - 1
                bodies[body] = _Body.of(jacobian, weight, v[rows], a[rows])
        return BodyMotion(self, samples, bodies)

    def _step(
        self, body: int, x: FloatArray, upstream: FloatArray | None, weight: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(6, m, N) Jacobian of a body in its own frame, and (3, N) minus gravity there."""
        axis = self.axes[body]
        skew = _skew(axis[3:])
        # rotation from the parent's frame: constant + sine + cosine part
        parts = np.array([np.eye(3) + skew @ skew, -skew, -skew @ skew]) @ self.rotations[body].T
        waves = np.array([np.ones_like(x), np.sin(x), np.cos(x)])
        back = np.tensordot(parts, waves, axes=(0, 0))  # (3, 3, N)

        def turned(vectors: FloatArray) -> FloatArray:
            result: FloatArray = back[:, 0, None] * vectors[0]
            for k in (1, 2):
                result += back[:, k, None] * vectors[k]
            return result

        own = np.broadcast_to(axis[:, None, None], (6, 1, len(x)))
        weight_here = turned(weight[:, None])[:, 0]
        if upstream is None:
            return own, weight_here
        shift = self.translations[body][:, None] + np.outer(self.rotations[body] @ axis[:3], x)
        linear = turned(upstream[:3] - _cross(shift[:, None], upstream[3:]))
        return np.concatenate([np.concatenate([linear, turned(upstream[3:])]), own], axis=1), weight_here


@dataclass(frozen=True, eq=False)
class _Body:
    """One body in a motion; every quantity is in its own frame, samples last.

    Attributes:
        jacobian: (6, m, N) along its path.
        velocity: (6, m, N) of each body of the path, as a motion of this frame.
        turning: (6, m, N) velocity x jacobian.
        acceleration: (6, m, N) of each body of the path, less gravity.
        v: (m, N) joint velocities.
        a: (m, N) joint accelerations.
    """

    jacobian: FloatArray
    velocity: FloatArray
    turning: FloatArray
    acceleration: FloatArray
    v: FloatArray
    a: FloatArray

    @staticmethod
    def of(jacobian: FloatArray, weight: FloatArray, v: FloatArray, a: FloatArray) -> "_Body":
        velocity = _running_sum(jacobian * v)
        turning = _motion_cross(velocity, jacobian)
        acceleration = _running_sum(jacobian * a + turning * v)
        acceleration[:3] += weight[:, None]
        return _Body(jacobian, velocity, turning, acceleration, v, a)

    @cached_property
    def z(self) -> FloatArray:
        """(12, N) classical acceleration less gravity, angular acceleration, products of angular velocity."""
        total, last = self.velocity[:, -1], self.acceleration[:, -1]
        omega = total[3:]
        return np.concatenate([last[:3] + _cross(omega, total[:3]), last[3:], omega[_ROW] * omega[_COLUMN]])

    @cached_property
    def dz(self) -> FloatArray:
        """(12, 3 m, N) derivative of z by positions, velocities and accelerations of the path."""
        jacobian, turning = self.jacobian, self.turning
        total = self.velocity[:, -1]
        linear, omega = total[:3, None], total[3:, None]
        # velocity and acceleration of what lies before each joint, and the velocity from it on
        before = self.acceleration - jacobian * self.a - turning * self.v
        downstream = total[:, None] - self.velocity + jacobian * self.v
        # V_{k-1} x J_k = V_k x J_k = turning
        a_x = _motion_cross(before, jacobian) + _motion_cross(turning, downstream)
        a_v = _motion_cross(jacobian, downstream) + turning
        dv = np.concatenate([turning, jacobian], axis=1)
        d_omega = dv[3:]
        m = jacobian.shape[1]
        out = np.zeros((12, 3 * m, jacobian.shape[2]))
        out[:3, : 2 * m] = _cross(d_omega, linear) + _cross(omega, dv[:3])
        for k, part in enumerate((a_x, a_v, jacobian)):
            out[:3, k * m : (k + 1) * m] += part[:3]
            out[3:6, k * m : (k + 1) * m] = part[3:]
        out[6:, : 2 * m] = d_omega[_ROW] * omega[_COLUMN] + omega[_ROW] * d_omega[_COLUMN]
        return out


@dataclass(frozen=True, eq=False)
class BodyMotion:
    """Bodies in a motion of N samples: their columns, and derivatives by position, velocity and acceleration.

    Attributes:
        columns_of: the columns.
        samples: N.
        bodies: every body that has columns.
    """

    columns_of: BodyColumns
    samples: int
    bodies: Mapping[int, _Body]

    def columns(self) -> FloatArray:
        """(J, p, N) columns."""
        chosen = self.columns_of
        columns = np.zeros((chosen.joints, chosen.count, self.samples))
        for index, body in self.bodies.items():
            tensor, rows = chosen.tensors[index], chosen.paths[index] - 1
            r = tensor.shape[1]
            wrench = (tensor.reshape(6 * r, 12) @ body.z).reshape(6, 1, r, self.samples)
            column = body.jacobian[0][:, None] * wrench[0]
            for axis in range(1, 6):
                column += body.jacobian[axis][:, None] * wrench[axis]
            columns[rows[:, None], chosen.places[index]] += column
        return columns

    def pull(self, lever: FloatArray) -> FloatArray:
        """Gradient of a weighted sum of all columns.

        Args:
            lever: (J, p, N) weights.

        Returns:
            (3 J, N) derivatives by positions, velocities and accelerations.
        """
        chosen = self.columns_of
        joints = chosen.joints
        gradient = np.zeros((3 * joints, self.samples))
        for index, body in self.bodies.items():
            tensor, rows = chosen.tensors[index], chosen.paths[index] - 1
            r, m = tensor.shape[1], len(rows)
            weight = lever[rows[:, None], chosen.places[index]]  # (m, r, N)
            gathered = np.zeros((6, r, self.samples))
            for k in range(m):
                gathered += body.jacobian[:, k, None] * weight[k]
            force = tensor.reshape(6 * r, 12).T @ gathered.reshape(6 * r, self.samples)  # (12, N)
            by_state = (body.dz * force[:, None]).sum(axis=0)  # (3 m, N)
            wrench = (tensor.reshape(6 * r, 12) @ body.z).reshape(6, r, self.samples)
            # rows upstream of joint k turn with it: J_j x J_k . (wrench of row j)
            share = np.stack([(wrench * weight[k]).sum(axis=1) for k in range(m)], axis=1)  # (6, m, N)
            own = _force_cross(body.jacobian, share)
            moment = _running_sum(own.copy()) - own
            by_state[:m] -= (body.jacobian * moment).sum(axis=0)
            for k in range(3):
                gradient[rows + k * joints] += by_state[k * m : (k + 1) * m]
        return gradient

    def slopes(self, stride: int = 1, dtype: type[np.floating] = np.float64) -> FloatArray:
        """(N, J, p, 3 J) derivatives of every column at every so many samples; rows lie next to each other."""
        chosen = self.columns_of
        joints = chosen.joints
        samples = len(range(0, self.samples, stride))
        slopes = np.zeros((samples, 3 * joints, chosen.count, joints), dtype=dtype)
        for index, body in self.bodies.items():
            jacobian = body.jacobian[..., ::stride]
            tensor, rows, take = chosen.tensors[index], chosen.paths[index] - 1, chosen.places[index]
            r, m = tensor.shape[1], len(rows)
            transposed = np.ascontiguousarray(jacobian.transpose(2, 1, 0), dtype=dtype)  # (N, m, 6)
            by_z = tensor.transpose(0, 2, 1).reshape(6, 12 * r).astype(dtype)
            levers = (transposed.reshape(-1, 6) @ by_z).reshape(samples, m, 12, r).transpose(0, 2, 3, 1)
            dz = np.ascontiguousarray(body.dz[..., ::stride].transpose(2, 1, 0), dtype=dtype)
            slope = (dz @ levers.reshape(samples, 12, r * m)).reshape(samples, 3 * m, r, m)
            if m > 1:
                # (J_j x J_k) . wrench = J_j . (J_k x wrench) for j < k
                wrench = (tensor.reshape(6 * r, 12) @ body.z[:, ::stride]).reshape(6, 1, r, samples)
                turned = _force_cross(jacobian[:, 1:, None], wrench).reshape(6, (m - 1) * r, samples)
                upstream = np.ascontiguousarray(turned.transpose(2, 1, 0), dtype=dtype) @ np.swapaxes(transposed, 1, 2)
                before = np.arange(m) < np.arange(1, m)[:, None, None]
                slope[:, 1:m] += upstream.reshape(samples, m - 1, r, m) * before
            if np.array_equal(rows, np.arange(m)) and len(take) and np.array_equal(take, take[0] + np.arange(r)):
                for k in range(3):
                    block = slopes[:, k * joints : k * joints + m, take[0] : take[0] + r, :m]
                    block += slope[:, k * m : (k + 1) * m]
            else:
                states = np.concatenate([rows, rows + joints, rows + 2 * joints])
                slopes[:, states[:, None, None], take[:, None], rows] += slope
        return slopes.transpose(0, 3, 2, 1)


def _force_cross(motion: FloatArray, force: FloatArray) -> FloatArray:
    """Cross product of a spatial motion with a wrench (force, moment) along axis 0."""
    linear = _cross(motion[3:], force[:3])
    out = np.empty((6, *linear.shape[1:]))
    out[:3] = linear
    np.add(_cross(motion[3:], force[3:]), _cross(motion[:3], force[:3]), out=out[3:])
    return out
