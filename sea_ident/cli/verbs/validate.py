"""`sea-ident validate`: a model against a recording that was not used to find it."""

from sea_ident.cli.inputs import read_columns, read_part
from sea_ident.cli.options import AsJson, Between, ForeignColumns, ModelFile, Period, RecordingFile
from sea_ident.cli.output import SHARES, by_share, emit, progress


def validate(
    model: ModelFile,
    recording: RecordingFile,
    period: Period = None,
    column: ForeignColumns = None,
    between: Between = None,
    as_json: AsJson = False,
) -> None:
    """Compare the torque that a model predicts with a recording, and its springs with their torque.

    The recording should be one that was not used to find the model.
    """
    from sea_ident.estimation import read_model
    from sea_ident.validation import validate as run

    loaded = read_model(model)
    columns = read_columns(column)
    with progress(f"reading {recording.name}", SHARES) as tell:
        result = run(loaded, read_part(recording, columns, between), period=period, progress=by_share(tell))
    emit(result.to_dict(), result.summary(), as_json=as_json)
