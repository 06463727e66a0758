"""percussions doctor."""

import typer

from analysis.cli.app import show


def doctor() -> None:
    """List the engines and the libraries of each part, and what to do about a missing one.

    Example: percussions doctor"""
    from analysis.engines.doctor import examine

    findings = examine()
    head = ["what", "part", "state", "version", "where"]
    rows = [(one.name, one.extra, one.state, one.version, one.path) for one in findings]
    show(head, [[str(cell or "–") for cell in row] for row in rows], numbers_from=5)
    for finding in findings:
        if finding.advice:
            print(f"{finding.name}: {finding.advice}")
    raise typer.Exit(any(finding.state == "missing" for finding in findings))
