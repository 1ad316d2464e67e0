"""The verbs, one per file, in the order in which `--help` lists them."""

from collections.abc import Callable

from sea_ident.cli.verbs.batch import batch
from sea_ident.cli.verbs.demo import demo
from sea_ident.cli.verbs.diagnose import diagnose
from sea_ident.cli.verbs.excite import excite
from sea_ident.cli.verbs.export import export
from sea_ident.cli.verbs.identify import identify
from sea_ident.cli.verbs.inspect import inspect
from sea_ident.cli.verbs.report import report
from sea_ident.cli.verbs.simulate import simulate
from sea_ident.cli.verbs.validate import validate

VERBS: tuple[Callable[..., None], ...] = (
    demo,
    inspect,
    excite,
    simulate,
    identify,
    validate,
    diagnose,
    export,
    report,
    batch,
)

__all__ = ["VERBS"]
