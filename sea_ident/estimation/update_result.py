"""What came of bringing an earlier model up to date."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Change:
    """A base parameter against its value in the earlier model.

    Attributes:
        name: its name.
        before: value in the earlier model.
        now: value from the new data alone.
        z: difference in standard deviations of the difference.
        changed: whether it is taken as changed, so that the earlier value does not count.
    """

    name: str
    before: float
    now: float
    z: float
    changed: bool


@dataclass(frozen=True)
class Update:
    """How an earlier model entered.

    Attributes:
        recording: the recording of the earlier model.
        changes: one per base parameter.
        statistic: chi square per degree of freedom of what is taken as unchanged, about 1 if it is.
        p_value: probability of a larger one if nothing else changed.
    """

    recording: str
    changes: tuple[Change, ...]
    statistic: float
    p_value: float

    @property
    def changed(self) -> tuple[str, ...]:
        """Names of the parameters that changed."""
        return tuple(change.name for change in self.changes if change.changed)

    def summary(self) -> str:
        """Text for people."""
        lines = [f"against the model from {self.recording}:"]
        for change in self.changes:
            mark = "changed" if change.changed else "kept"
            lines.append(f"  {change.name}: {change.before:.6g} -> {change.now:.6g} (z = {change.z:+.1f}), {mark}")
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """A form that JSON can hold."""
        return {**asdict(self), "changed": list(self.changed)}

    @classmethod
    def from_dict(cls, record: Mapping[str, Any]) -> "Update":
        """What `to_dict` wrote."""
        return cls(
            recording=str(record["recording"]),
            changes=tuple(Change(**change) for change in record["changes"]),
            statistic=float(record["statistic"]),
            p_value=float(record["p_value"]),
        )
