"""percussions doctor."""

import typer

from analysis.cli.app import show


def doctor() -> None:
    """List the engines and the libraries of each part, and what to do about a missing one.

    Example: percussions doctor"""
    from analysis.engines.doctor import examine

    findings = examine()
    show(
        ["what", "part", "state", "version", "where"],
        [
            [
                finding.name,
                finding.extra or "–",
                finding.state,
                finding.version or "–",
                str(finding.path or "–"),
            ]
            for finding in findings
        ],
        numbers_from=5,
    )
    for finding in findings:
        if finding.advice:
            print(f"{finding.name}: {finding.advice}")
    if any(finding.state == "missing" for finding in findings):
        raise typer.Exit(1)
