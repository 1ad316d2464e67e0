import numpy as np
import pytest
from plants import from_parts, joint, link, motor

from sea_ident import Motion, SeaIdentError
from sea_ident.simulation import FrictionJitter, PreslidingCoulomb, SmoothCoulomb, VelocityController, simulate


def test_smooth_law_is_within_four_percent_of_the_sign_above_twice_the_smoothing():
    friction = SmoothCoulomb(0.02).start(0.5, 3.0, 0.0)
    for speed in (0.04, 0.1, 2.0):
        assert friction.torque(0.0, speed) - 0.5 * speed == pytest.approx(3.0, rel=0.04)
        assert friction.torque(0.0, -speed) == -friction.torque(0.0, speed)


def test_slope_is_the_derivative():
    friction = SmoothCoulomb(0.02).start(0.5, 3.0, 0.0)
    for speed in (-0.03, 0.0, 0.011):
        numeric = (friction.torque(0.0, speed + 1e-6) - friction.torque(0.0, speed - 1e-6)) / 2e-6
        assert friction.slope(speed) == pytest.approx(numeric, rel=1e-6)


def test_presliding_contact_does_not_depend_on_how_the_distance_is_divided():
    once, often = (PreslidingCoulomb(1e-3).start(0.0, 2.0, 0.1) for _ in range(2))
    for position in np.linspace(0.1, 0.1015, 300):
        often.accept(float(position), 1.0)
    once.accept(0.1015, 1.0)
    assert once.torque(0.1015, 1.0) == pytest.approx(often.torque(0.1015, 1.0), rel=1e-12)
    assert once.torque(0.1015, 1.0) == pytest.approx(2.0 * (1.0 - np.exp(-1.5)))
    assert once.torque(0.1, 0.0) < 0.0


def hold(law, quiet):
    """A mass on a slope of torque below its Coulomb friction, with no controller to speak of."""
    robot = from_parts(
        '<link name="base"/>', link("bob"), joint("a", "base", "bob", "0 1 0"),
        motor("a", None, "<viscousFriction>2</viscousFriction><coulombFriction>4</coulombFriction>"),
    )  # fmt: skip
    still = Motion.rigid(np.linspace(0.0, 4.0, 101), np.full((101, 1), 0.3), *(np.zeros((101, 1)) for _ in range(2)))
    soft = VelocityController(bandwidth=1e-9, correction=0.0, feedforward=0.0)
    return simulate(robot, still, controller=soft, **{**quiet, "friction": law}).motion


def test_true_stiction_holds_what_the_smooth_law_lets_creep(quiet):
    held, creeping = hold(PreslidingCoulomb(1e-3), quiet), hold(SmoothCoulomb(0.02), quiet)
    assert abs(held.q[-1, 0] - held.q[-40, 0]) < 1e-6
    assert abs(held.q[-1, 0] - 0.3) < 5e-3
    assert abs(creeping.q[-1, 0] - creeping.q[-40, 0]) > 1e-3


def test_jitter_averages_out_and_fades_with_speed():
    jitter = FrictionJitter(spread=0.3, speed=0.1)
    friction = jitter.on(SmoothCoulomb(0.005).start(0.0, 2.0, 0.0), np.random.SeedSequence(5))
    slow, fast = [], []
    for k in range(4000):
        sign = 1.0 if k % 2 else -1.0
        slow.append(sign * friction.torque(0.0, sign * 0.03))
        fast.append(sign * friction.torque(0.0, sign * 0.5))
        friction.accept(0.0, sign * 0.03)
    expected = 2.0 * 0.3 * np.exp(-0.09)
    assert np.std(slow) == pytest.approx(expected, rel=0.05)
    assert np.mean(slow) == pytest.approx(2.0, abs=4.0 * expected / np.sqrt(4000))
    assert np.std(fast) < 1e-9


def test_jitter_never_turns_friction_into_a_drive():
    friction = FrictionJitter(spread=5.0, speed=1.0).on(
        SmoothCoulomb(1e-3).start(0.0, 2.0, 0.0), np.random.SeedSequence(1)
    )
    for k in range(200):
        sign = 1.0 if k % 2 else -1.0
        assert sign * friction.torque(0.0, sign * 0.01) >= 0.0
        friction.accept(0.0, sign * 0.01)


@pytest.mark.parametrize(
    "build",
    [
        lambda: SmoothCoulomb(0.0),
        lambda: PreslidingCoulomb(-1.0),
        lambda: FrictionJitter(spread=-0.1),
        lambda: FrictionJitter(speed=0.0),
    ],
)
def test_impossible_numbers_are_refused(build):
    with pytest.raises(SeaIdentError, match="must"):
        build()
