"""The command line: the verbs of the library. Nothing else in sea_ident prints or exits."""

from sea_ident.cli.app import app, main

__all__ = ["app", "main"]
