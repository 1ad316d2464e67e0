"""Reports: one self-contained HTML file per model or diagnosis."""

from sea_ident.report.page import write_report

__all__ = ["write_report"]
