"""The `percussions` command."""

from __future__ import annotations

import logging
import sys

import typer

from analysis.cli import accuracy, crowd, forces, paper
from analysis.cli.app import app

__all__ = ["app", "main"]
INTERRUPTED = 130
for group in (crowd, forces, accuracy, paper):  # in the order of --help
    app.add_typer(group.commands)


@app.command()
def doctor() -> None:
    """Which engines and libraries are there, their versions, and what to do about a missing one.

    Example: percussions doctor
    """
    from analysis.engines.doctor import examine

    findings = examine()
    for finding in findings:
        print(
            f"{finding.name:<12}{finding.state:<10}{finding.version or '–'}  {finding.path or ''}"
        )
        if finding.advice:
            print(f"{'':<12}{finding.advice}")
    if any(finding.state == "missing" for finding in findings):
        raise typer.Exit(1)


def main() -> None:
    """Run the command; errors of the input are one line and exit status 1."""
    from analysis.engines.record import EngineError

    logging.basicConfig(
        level=logging.INFO if "-v" in sys.argv else logging.WARNING, format="%(message)s"
    )
    try:
        app()
    except SystemExit as end:
        if end.code == INTERRUPTED:
            print("percussions: interrupted; earlier results are untouched", file=sys.stderr)
        raise
    except (ValueError, OSError, EngineError) as error:
        print(f"percussions: {error}", file=sys.stderr)
        sys.exit(1)
