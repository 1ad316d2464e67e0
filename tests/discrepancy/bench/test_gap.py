"""How far model and data are apart beyond the noise."""

from sea_ident.discrepancy.bench.gap import Gap, drowned
from sea_ident.discrepancy.measured.check import Findings


def test_noise_beyond_the_torque_lets_nothing_be_told():
    before = Findings(("clipped",))
    sound = Gap({"hip": 0.1, "grip": 0.0}, {"hip": 0.0, "grip": 0.0}, {"hip": 0.05, "grip": 0.3})
    assert drowned(before, sound, {"hip": 10.0, "grip": 4.0}) is before
    for noise in (5e21, float("inf"), float("nan")):
        lost = Gap(sound.before, sound.after, {"hip": 0.05, "grip": noise})
        found = drowned(before, lost, {"hip": 10.0, "grip": 4.0})
        assert found.fatal
        assert found.warnings[0] == "clipped"
        assert "the noise of grip" in found.warnings[1]
        # of a joint that stands nothing is compared, and the others are told without it; where all do, none is
        assert drowned(before, lost, {"hip": 10.0, "grip": 4.0}, ("grip",)) is before
        assert drowned(before, lost, {"hip": 10.0, "grip": 4.0}, ("hip", "grip")) == found
