"""From a recording to what identification works on: motion with derivatives, motor torque and its scatter."""

from sea_ident.processing.process import filter_recording, from_states, process
from sea_ident.processing.processed import ProcessedRecording

__all__ = ["ProcessedRecording", "filter_recording", "from_states", "process"]
