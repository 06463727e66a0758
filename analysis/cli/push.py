"""percussions push."""

from pathlib import Path

from analysis.cli.app import command_line, progress, say_expected, show, show_page, warn
from analysis.cli.options import InputFile, Out, Share


def push(
    file: InputFile,
    *,
    wall: float | None = None,
    arms: list[Share] | None = None,
    reach: list[Share] | None = None,
    out: Out = Path("push"),
) -> None:
    """Compute a push trial after the event: which models beat the baselines?

    The first of the row moves as measured. The others move by penalty contacts (2·10³ to 10⁶ N/m)
    or as rigid people, in 5,000 cases of posture, arms, floor and chests. Nothing is fitted. Also read, if
    there: Weight_kg, Gender, MoCap_ID and Order_of_Participants_MoCap_ID.

    Writes a page, scores.csv and onsets.csv.

    file: CSV with id, time, x, y: heads of people in a row.
    wall: Where a wall crosses the row, in m: x or y as in the file.
    arms: Share of the room between chests that arms bridge from the start. Several: drawn between
        the least and the most. By default 0 to 1.
    reach: Reach of the soft layer of arms in m. Several: drawn between the
        least and the longest. By default 0 to 0.2.

    Example: percussions push scenes/push_excerpt.csv"""
    from analysis.push.hindcast import ARMS, REACH_M, expected_seconds, hindcast
    from analysis.push.page import HEAD, summary, verdicts, write_hindcast
    from analysis.push.trial import read_trial

    trial = read_trial(file, wall)
    for note in trial.notes:
        warn(note)
    say_expected(expected_seconds(trial), f"rows of {len(trial.people)} people")
    with progress() as bars:
        found = hindcast(trial, arms or ARMS, reach=reach or REACH_M, progress=bars)
    *tables, page = write_hindcast(found, out, command_line())
    show(HEAD, summary(found), title=f"{file.name}: median (5 – 95 %) of the possible cases")
    for line in verdicts(found):
        print(f"- {line.replace('**', '')}")
    print(*tables, sep="\n")
    show_page(page)
