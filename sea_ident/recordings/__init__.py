"""Recordings: signals over time, read from and written to the formats that robots log in."""

from sea_ident.recordings.alignment import AlignedRecording, ClockAlignment, Stream, StreamReport, align_streams
from sea_ident.recordings.columns import ColumnSource
from sea_ident.recordings.files import read_recording, write_recording
from sea_ident.recordings.recording import Recording

__all__ = [
    "AlignedRecording",
    "ClockAlignment",
    "ColumnSource",
    "Recording",
    "Stream",
    "StreamReport",
    "align_streams",
    "read_recording",
    "write_recording",
]
