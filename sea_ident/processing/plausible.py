"""What no robot does, but a wrong unit, a wrong column or a broken encoder: said before anything is identified."""

from itertools import combinations

import numpy as np

from sea_ident._typing import FloatArray
from sea_ident.processing.broken_encoders import HARDLY, held, jumps, slips, stands_still
from sea_ident.processing.doubt import Doubt, DoubtKind, say_column
from sea_ident.recordings import Recording
from sea_ident.robot import Joint, Robot

BEYOND = 0.2
"""Share of the width of the position limits by which a motion may leave them without a word."""

WIDER = 5.0
"""Excess over the position limits, in widths of theirs, from which on the unit is doubted; limits may be wrong too."""

STRONGER = 3.0
"""Torque over its limit from which on its unit is doubted."""

ALIKE = 0.3
"""Largest deviation of the slope of theta over q from 1 without a word; a soft spring gives a tenth."""

TOGETHER = 0.95
"""Correlation from which on a motor and a link are those of one joint [-]."""

RECOGNISED = 0.15
"""Deviation from a factor up to which it is recognised."""

HELD = 0.02
"""How far from where it is locked a joint may be [rad] or [m]: a brake gives that much."""

SPEED_SAMPLES = 10
"""Samples over which a speed is taken, so that noise of an encoder is none."""

TOO_FAST = 8.0
"""Usual speed over its limit from which on the unit is doubted."""


def doubts(recording: Recording, robot: Robot, q: FloatArray, theta: FloatArray, torque: FloatArray) -> list[Doubt]:
    """Doubts about columns that cannot be what their names say.

    Args:
        recording: where they come from.
        robot: the robot, with its limits.
        q: (M, n) link positions [rad] or [m].
        theta: (M, n) motor positions after the gear, those of the links at rigid joints [rad] or [m].
        torque: (M, n) motor torque at the joint side [N m] or [N].

    Returns:
        What is wrong, where, and what to do; empty where all may be as it says.
    """
    found: list[Doubt] = []

    def doubt(kind: DoubtKind, texts: list[str]) -> None:
        found.extend(Doubt(kind, f"{recording.source}: {text}") for text in texts)

    exchanged = _exchanged(robot, q, theta)
    doubt(DoubtKind.POSITION, [_say_exchanged(*pair) for pair in exchanged])
    others = {name for pair in exchanged for name in pair}
    for i, joint in enumerate(robot.joints):
        doubt(DoubtKind.POSITION, _position(joint, robot.limits.lower[i], robot.limits.upper[i], q[:, i]))
        if not np.isfinite(robot.limits.upper[i] - robot.limits.lower[i]):
            doubt(DoubtKind.POSITION, _speed(recording.time, joint, robot.limits.velocity[i], q[:, i]))
        doubt(DoubtKind.TORQUE, _torque(recording, joint, robot.limits.torque[i], torque[:, i]))
        sensors = [(f"q_{joint.name}", q[:, i])]
        if joint.elastic:
            if joint.name not in others:
                doubt(*_slope(joint, q[:, i], theta[:, i]))
            if recording.has("tau_spring", joint.name):
                measured = recording.channel("tau_spring", [joint.name])[:, 0]
                doubt(DoubtKind.TORQUE, _sensor(joint, measured, theta[:, i] - q[:, i]))
            sensors.append((f"theta_{joint.name}", theta[:, i]))
        for k, (name, values) in enumerate(sensors):
            partner = sensors[1 - k] if joint.elastic else None
            doubt(DoubtKind.SENSOR, stands_still(recording.time, name, values, joint, partner))
            doubt(DoubtKind.SENSOR, jumps(recording.time, name, values, joint))
        if joint.elastic and not any(jumps(recording.time, name, values, joint) for name, values in sensors):
            doubt(DoubtKind.SENSOR, slips(recording.time, joint, theta[:, i] - q[:, i]))
        sensors.append((f"the torque of {joint.name}", torque[:, i]))
        for name, values in sensors:
            doubt(DoubtKind.SENSOR, held(recording.time, name, values))
    doubt(DoubtKind.POSITION, _not_held(recording, robot))
    return found


def _exchanged(robot: Robot, q: FloatArray, theta: FloatArray) -> list[tuple[str, str]]:
    """Pairs of joints of which each motor moves as the link of the other, and not as its own."""
    elastic = [i for i in robot.elastic_indices if np.ptp(q[:, i]) > 0.0 and np.ptp(theta[:, i]) > 0.0]
    return [
        (robot.joint_names[i], robot.joint_names[j])
        for i, j in combinations(elastic, 2)
        if all(_goes_with(q[:, a], theta[:, b]) for a, b in ((i, j), (j, i)))
        and not any(_goes_with(q[:, k], theta[:, k]) for k in (i, j))
    ]


def _goes_with(q: FloatArray, theta: FloatArray) -> bool:
    """Whether a motor moves as far as a link, at the same time."""
    slope = float(np.cov(q, theta)[0, 1] / np.var(q, ddof=1))
    return abs(slope - 1.0) <= ALIKE and bool(np.corrcoef(q, theta)[0, 1] > TOGETHER)


def _say_exchanged(one: str, other: str) -> str:
    names = " ".join(f"--column 'q_{a}=q_{b}'" for a, b in ((one, other), (other, one)))
    return (
        f"theta_{one} moves as q_{other}, and theta_{other} as q_{one}: columns q of {one!r} and {other!r} look "
        f"exchanged, or those of theta. Name them the other way (ColumnSource, on the command line {names}, or the "
        "same with theta)"
    )


def _not_held(recording: Recording, robot: Robot) -> list[str]:
    """Whether joints that the model holds where they are locked are elsewhere in the recording, or move."""
    free = {}
    for name, at in robot.locked.items():
        if recording.has("q", name):
            values = recording.channel("q", [name])[:, 0]
            if float(np.max(np.abs(values - at))) > HELD:
                free[name] = f"q_{name} goes from {values.min():.4g} to {values.max():.4g}, held at {at:.4g}"
    if not free:
        return []
    return [
        f"joints that the model holds are not held: {'; '.join(list(free.values())[:3])}"
        f"{f'; and {len(free) - 3} more' if len(free) > 3 else ''}. What they carry is not where the model has it. "
        f"Name {', '.join(free)} among the joints that move (load_robot, --joints), or record with them held"
    ]


def beyond_limits(recording: Recording, robot: Robot, q: FloatArray) -> list[str]:
    """Sentences about motions (M, n) [rad] or [m] somewhat outside the limits of their joints."""
    found = []
    for i, joint in enumerate(robot.joints):
        lower, upper = robot.limits.lower[i], robot.limits.upper[i]
        if BEYOND * (upper - lower) < _excess(lower, upper, q[:, i]) <= WIDER * (upper - lower):
            found.append(
                f"{recording.source}: {_extent(joint, lower, upper, q[:, i])}: if they are right, is it the column of "
                "another joint, or is its zero another one?"
            )
    return found


def _excess(lower: float, upper: float, q: FloatArray) -> float:
    """How far a position leaves its limits [rad] or [m]."""
    return float(max(lower - q.min(), q.max() - upper)) if np.isfinite(upper - lower) else 0.0


def _extent(joint: Joint, lower: float, upper: float, q: FloatArray) -> str:
    unit = joint.position_unit
    return (
        f"q_{joint.name} goes from {q.min():.4g} to {q.max():.4g} {unit}, its limits are {lower:.4g} and {upper:.4g} "
        f"{unit}"
    )


def _position(joint: Joint, lower: float, upper: float, q: FloatArray) -> list[str]:
    """Whether a motion is so far outside the limits of its joint that its unit must be another."""
    column, width, low, high = f"q_{joint.name}", upper - lower, float(q.min()), float(q.max())
    if _excess(lower, upper, q) <= WIDER * width:
        return []
    where = _extent(joint, lower, upper, q)
    factor, other = (0.001, "mm") if joint.prismatic else (np.pi / 180.0, "deg")
    spare = 2.0 * width
    if low * factor >= lower - spare and high * factor <= upper + spare:
        long = "millimetres" if joint.prismatic else "degrees"
        both = f", and the same for theta_{joint.name}" if joint.elastic else ""
        return [f"{where}: is it in {long}? Then {say_column(column, f'unit={other}')}{both}"]
    return [f"{where}: is it in another unit, such as counts of the encoder (unit=counts,counts_per_rev=...)?"]


def _speed(time: FloatArray, joint: Joint, limit: float, q: FloatArray) -> list[str]:
    """Whether a joint without limits of its position is so much faster than its limit that its unit must be another."""
    if len(q) <= SPEED_SAMPLES:
        return []
    speeds = np.abs(q[SPEED_SAMPLES:] - q[:-SPEED_SAMPLES]) / (time[SPEED_SAMPLES:] - time[:-SPEED_SAMPLES])
    usual = float(np.percentile(speeds, 90.0))
    if not usual > TOO_FAST * limit:
        return []
    column, unit = f"q_{joint.name}", joint.position_unit
    where = f"{column} moves at {usual:.4g} {unit}/s, its limit is {limit:.4g} {unit}/s"
    factor, other, long = (0.001, "mm", "millimetres") if joint.prismatic else (np.pi / 180.0, "deg", "degrees")
    if usual * factor <= 2.0 * limit:
        both = f", and the same for theta_{joint.name}" if joint.elastic else ""
        return [f"{where}: is it in {long}? Then {say_column(column, f'unit={other}')}{both}"]
    return [f"{where}: is it in another unit, such as counts of the encoder, or is time?"]


def _torque(recording: Recording, joint: Joint, limit: float, torque: FloatArray) -> list[str]:
    """Whether the usual torque is far beyond what the joint can bear."""
    usual = float(np.percentile(np.abs(torque), 90.0))
    if not usual > STRONGER * limit:
        return []
    where = f"reaches {usual:.4g} {joint.torque_unit} at the joint {joint.name!r}, whose limit is {limit:.4g}"
    if recording.has("tau_motor", joint.name):
        return [f"tau_motor_{joint.name} {where}: is it in another unit, or at another side of the gear?"]
    column = f"current_{joint.name}"
    return [
        f"{column} times torque constant and gear ratio {where}: is the current in milliamperes? Then "
        f"{say_column(column, 'unit=mA')}; else look at <torqueConstant> and <mechanicalReduction>"
    ]


def _slope(joint: Joint, q: FloatArray, theta: FloatArray) -> tuple[DoubtKind, list[str]]:
    """Whether motor and link move as far: theta is meant after the gear, in the unit and sense of q.

    With a factor that is that of a unit, a sign or a gear, one of the two is wrong; with any other it may be a spring
    that is as soft as that.
    """
    soft = DoubtKind.SPRING
    power, other = float(np.var(q)), float(np.var(theta))
    if np.ptp(q) == 0.0 or np.ptp(theta) == 0.0 or joint.actuator is None:
        return soft, []  # said elsewhere
    covariance = float(np.mean((q - q.mean()) * (theta - theta.mean())))
    slope, correlation = covariance / power, covariance / np.sqrt(power * other)
    if abs(slope - 1.0) <= ALIKE:
        return soft, []
    column, ratio, turn = f"theta_{joint.name}", joint.actuator.gear_ratio, 180.0 / np.pi
    where = f"{column} moves {slope:.4g} times as far as q_{joint.name}"
    causes = {
        -1.0: ("has one of the two the wrong sign?", column, "sign=-1"),
        ratio: ("is it the angle before the gear?", column, f"gear_ratio={ratio:g}"),
        -ratio: ("is it the angle before the gear, with the other sign?", column, f"gear_ratio={-ratio:g}"),
        turn: ("is it in degrees?", column, "unit=deg"),
        1.0 / turn: (f"is q_{joint.name} in degrees?", f"q_{joint.name}", "unit=deg"),
    }
    for factor, (question, name, setting) in causes.items():
        if abs(slope / factor - 1.0) <= RECOGNISED and abs(correlation) > 0.7:
            return DoubtKind.POSITION, [f"{where}: {question} Then {say_column(name, setting)}"]
    held = "is the motor held, as by friction or a brake? Or " if np.std(theta) < HARDLY * np.std(q) else ""
    return soft, [
        f"{where}, correlation {correlation:.2f}: {held}are both of this joint, in one unit, and theta after the gear? "
        "The spring is between them, and all that is identified rests on it"
    ]


def _sensor(joint: Joint, torque: FloatArray, deflection: FloatArray) -> list[str]:
    """Whether a measured spring torque follows the deflection."""
    column = f"tau_spring_{joint.name}"
    if np.ptp(torque) == 0.0:
        return [f"{column} is constant, {torque[0]:g} {joint.torque_unit}: is the sensor dead? Leave it out"]
    if np.ptp(deflection) > 0.0 and np.corrcoef(torque, deflection)[0, 1] < -0.5:
        return [
            f"{column} falls where the deflection rises: has it the wrong sign? Then {say_column(column, 'sign=-1')}"
        ]
    return []


def unused(recording: Recording, robot: Robot) -> list[str]:
    """Sentences about measured signals that the identification does not look at."""
    measured = [f"tau_spring_{j.name}" for j in robot.joints if j.elastic and recording.has("tau_spring", j.name)]
    if not measured:
        return []
    return [
        f"{', '.join(measured)}: not used here, where springs follow from the motor torque; "
        "identify_measured_springs fits them to the measured torque"
    ]
