"""Waves along the path of a joint that came out as the longest that there are, and do not fit either.

Where the true effect is not in the library, a ripple of which the motion sees but a part bends to much that changes
along the path: to a spring in parallel, to an encoder that is out of true, to what a motor loses under a large load.
It ends as a wave much longer than a turn of the joint. Where a motion does not show the length of a wave such a length
says nothing, and the wave fits; where something is left beside it, the length is what came nearest to something else,
for nothing in a joint turns so slowly.
"""

from dataclasses import dataclass

from sea_ident.discrepancy.bench import Bench
from sea_ident.discrepancy.judge import slowest
from sea_ident.discrepancy.lack import LACK_LEVEL, lack_of_fit
from sea_ident.discrepancy.relatives import Unnamed
from sea_ident.discrepancy.search import Selection


@dataclass(frozen=True)
class LongWave(Unnamed):
    """A wave that was found, and that no part of the joint can make."""

    @property
    def sentence(self) -> str:
        """What it is not."""
        return (
            f"The {self.effect} at {self.joint} came out as {self.relative}: nothing in a joint turns so slowly, so it "
            "stands in for something else that changes along the path."
        )


def long_waves(bench: Bench, selection: Selection) -> tuple[LongWave, ...]:
    """Waves that were found, ended as the longest that there are, and leave more than noise.

    Args:
        bench: the recording.
        selection: what was found.

    Returns:
        One entry for every such wave.
    """
    fit = selection.final.fit
    waves = [effect for effect in selection.effects if slowest(effect)]
    if not waves or lack_of_fit(bench, selection.final)[2] >= LACK_LEVEL:
        return ()
    relative = "less than a wave in a turn"
    return tuple(LongWave(effect.name, effect.joint, relative, 1.0, fit) for effect in waves)
