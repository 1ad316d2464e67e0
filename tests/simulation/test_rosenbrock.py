import numpy as np
import pytest

from sea_ident.simulation.rosenbrock import ros34pw2


def integrate(f, jacobian, y, span, steps, *, embedded=False):
    """The method in its textbook form, on y' = f(t, y), or the method of one order less that is embedded in it."""
    method, h = ros34pw2(), span / steps
    identity = np.eye(len(y))
    for k in range(steps):
        u = np.zeros((len(method.weights), len(y)))
        for i in range(len(u)):
            stage = y + method.stage[i, :i] @ u[:i]
            right = f(k * h + method.nodes[i] * h, stage) + method.coupling[i, :i] @ u[:i] / h
            u[i] = np.linalg.solve(identity / (h * method.gamma) - jacobian, right)
        y = y + (method.weights - method.error if embedded else method.weights) @ u
    return y


JACOBIANS = [np.zeros((2, 2)), np.array([[0.0, 1.0], [-1.7, -0.9]])]


def orders(jacobian, **how):
    # y'' = -y + sin(2 t): y = cos t + (2/3) sin t - (1/3) sin 2 t from y(0) = 1, y'(0) = 0
    def f(t, y):
        return np.array([y[1], -y[0] + np.sin(2.0 * t)])

    truth = np.cos(2.0) + 2.0 / 3.0 * np.sin(2.0) - np.sin(4.0) / 3.0
    errors = [abs(integrate(f, jacobian, np.array([1.0, 0.0]), 2.0, n, **how)[0] - truth) for n in (32, 64, 128)]
    return np.log2(np.array(errors[:-1]) / errors[1:])


@pytest.mark.parametrize("jacobian", JACOBIANS)
def test_order_three_whatever_the_jacobian(jacobian):
    assert np.all(orders(jacobian) > 2.8)


def test_what_tells_the_error_of_a_step_is_of_order_two():
    found = orders(JACOBIANS[1], embedded=True)
    assert np.all(found > 1.8)
    assert np.all(found < 2.3)


def test_a_step_far_beyond_the_time_constant_is_damped_at_once():
    rate = -1e6
    y = integrate(lambda t, y: rate * y, np.array([[rate]]), np.array([1.0]), 0.01, 1)
    assert abs(y[0]) < 1e-3
