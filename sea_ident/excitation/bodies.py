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

from collections.abc import Sequence
from dataclasses import dataclass

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


def _cross(x: FloatArray, y: FloatArray) -> FloatArray:
    """Cross product along axis 1, broadcasting over the others."""
    out = np.empty(np.broadcast_shapes(x.shape, y.shape))
    x0, x1, x2 = x[:, 0], x[:, 1], x[:, 2]
    y0, y1, y2 = y[:, 0], y[:, 1], y[:, 2]
    np.subtract(x1 * y2, x2 * y1, out=out[:, 0])
    np.subtract(x2 * y0, x0 * y2, out=out[:, 1])
    np.subtract(x0 * y1, x1 * y0, out=out[:, 2])
    return out


def _motion_cross(x: FloatArray, y: FloatArray) -> FloatArray:
    """Cross product of spatial motions (linear, angular) along axis 1, broadcasting over the others."""
    out = np.empty(np.broadcast_shapes(x.shape, y.shape))
    np.add(_cross(x[:, 3:], y[:, :3]), _cross(x[:, :3], y[:, 3:]), out=out[:, :3])
    out[:, 3:] = _cross(x[:, 3:], y[:, 3:])
    return out


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
    def torque(model: pin.Model) -> "BodyColumns":
        """The torque of a model with its own inertial parameters, as a single column."""
        tensors = [np.zeros((6, 0, 12))]
        for k in range(1, model.njoints):
            values = model.inertias[k].toDynamicParameters()
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
            jacobian = pin.getJointJacobian(model, data, k, pin.ReferenceFrame.LOCAL)
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

    def evaluate(
        self, x: FloatArray, v: FloatArray, a: FloatArray, *, derivatives: bool = True
    ) -> tuple[FloatArray, FloatArray]:
        """Columns and their derivatives.

        Args:
            x: (N, J) positions.
            v: (N, J) velocities.
            a: (N, J) accelerations.
            derivatives: whether to compute them.

        Returns:
            (N, J, p) columns; (N, J, p, 3 J) derivatives with respect to x, v and a (empty if not asked for).
        """
        samples, joints = x.shape
        columns = np.zeros((samples, joints, self.count))
        slopes = np.zeros((samples, joints, self.count, 3 * joints if derivatives else 0))
        jacobians: dict[int, FloatArray] = {}
        weight: dict[int, FloatArray] = {}
        root = np.broadcast_to(-self.gravity[:, None], (samples, 3, 1))
        for body in range(1, joints + 1):
            parent = self.parents[body]
            path = self.paths[body]
            jacobian, gravity = self._step(body, x[:, body - 1], jacobians.get(parent), weight.get(parent, root))
            jacobians[body], weight[body] = jacobian, gravity
            if not len(self.places[body]):
                continue
            rows, take = path - 1, self.places[body]
            column, slope = self._body(body, jacobian, gravity, v[:, rows], a[:, rows], derivatives)
            columns[:, rows[:, None], take] += column
            if derivatives:
                states = np.concatenate([rows, rows + joints, rows + 2 * joints])
                slopes[:, rows[:, None, None], take[:, None], states] += slope
        return columns, slopes

    def _step(
        self, body: int, x: FloatArray, upstream: FloatArray | None, weight: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """(N, 6, m) Jacobian of a body in its own frame, and (N, 3, 1) minus gravity there."""
        axis = self.axes[body]
        linear, angular = axis[:3], axis[3:]
        skew = _skew(angular)
        sine, cosine = np.sin(x)[:, None, None], np.cos(x)[:, None, None]
        turn = np.eye(3) + sine * skew + (1.0 - cosine) * (skew @ skew) if np.any(angular) else np.eye(3)[None]
        rotation = self.rotations[body] @ turn  # (N, 3, 3) this frame in the parent's
        back = np.swapaxes(rotation, 1, 2)
        own = np.broadcast_to(axis[:, None], (len(x), 6, 1))
        if upstream is None:
            return own, back @ weight
        shift = self.translations[body] + x[:, None] * (self.rotations[body] @ linear)
        lever = _cross(shift[:, :, None], upstream[:, 3:])
        moved = np.concatenate([back @ (upstream[:, :3] - lever), back @ upstream[:, 3:]], axis=1)
        return np.concatenate([moved, own], axis=2), back @ weight

    def _body(
        self, body: int, jacobian: FloatArray, weight: FloatArray, v: FloatArray, a: FloatArray, derivatives: bool
    ) -> tuple[FloatArray, FloatArray]:
        """(N, m, r) columns of one body and (N, m, r, 3 m) derivatives, along its path."""
        samples, _, depth = jacobian.shape
        tensor = self.tensors[body]
        r = tensor.shape[1]
        moving = jacobian * v[:, None]
        velocity = np.cumsum(moving, axis=2)  # (N, 6, m) of each joint's own body, in this frame
        turning = _motion_cross(velocity, jacobian)  # V_k x J_k
        acceleration = np.cumsum(jacobian * a[:, None] + turning * v[:, None], axis=2)
        acceleration[:, :3] += weight
        total = velocity[:, :, -1]
        linear, omega = total[:, :3], total[:, 3:]
        alpha = acceleration[:, 3:, -1]
        classical = acceleration[:, :3, -1] + _cross(omega, linear)
        z = np.concatenate([classical, alpha, omega[:, _ROW] * omega[:, _COLUMN]], axis=1)
        transposed = np.ascontiguousarray(np.swapaxes(jacobian, 1, 2))  # (N, m, 6)
        levers = (transposed.reshape(-1, 6) @ tensor.reshape(6, -1)).reshape(samples, depth * r, 12)
        column = (levers @ z[:, :, None]).reshape(samples, depth, r)
        if not derivatives:
            return column, column
        # derivatives of the body's velocity and acceleration
        before = velocity - moving  # V_{k-1}
        acceleration_before = acceleration - jacobian * a[:, None] - turning * v[:, None]
        downstream = total[:, :, None] - before
        v_x = turning  # V_{k-1} x J_k = V_k x J_k
        a_x = _motion_cross(acceleration_before, jacobian) + _motion_cross(v_x, downstream)
        a_v = _motion_cross(jacobian, downstream) + turning
        zero = np.zeros_like(jacobian)
        dv = np.concatenate([v_x, jacobian, zero], axis=2)  # (N, 6, 3 m)
        da = np.concatenate([a_x, a_v, jacobian], axis=2)
        d_omega = dv[:, 3:]
        d_classical = da[:, :3] + _cross(d_omega, linear[:, :, None]) + _cross(omega[:, :, None], dv[:, :3])
        products = d_omega[:, _ROW] * omega[:, _COLUMN, None] + omega[:, _ROW, None] * d_omega[:, _COLUMN]
        dz = np.concatenate([d_classical, da[:, 3:], products], axis=1)  # (N, 12, 3 m)
        slope = (levers @ dz).reshape(samples, depth, r, 3 * depth)
        # the rows turn with the joints downstream of them
        wrench = (tensor.reshape(-1, 12) @ z.T).reshape(6, r, samples).transpose(2, 1, 0)  # (N, r, 6)
        for k in range(1, depth):
            turned = _motion_cross(jacobian[:, :, :k], jacobian[:, :, k : k + 1])  # (N, 6, k)
            slope[:, :k, :, k] += np.swapaxes(wrench @ turned, 1, 2)
        return column, slope
