"""percussions doctor."""

import typer

from analysis.cli.app import show


def doctor() -> None:
    """List the engines and libraries that are here, and what to do about a missing one.

    Example: percussions doctor
    """
    from analysis.engines.doctor import examine

    findings = examine()
    show(
        ["what", "state", "version", "where"],
        [
            [finding.name, finding.state, finding.version or "–", str(finding.path or "–")]
            for finding in findings
        ],
        numbers_from=4,
    )
    for finding in findings:
        if finding.advice:
            print(f"{finding.name}: {finding.advice}")
    if any(finding.state == "missing" for finding in findings):
        raise typer.Exit(1)
