"""Writing results: whole or not at all; and what commands print."""

import errno
import os
import stat
import subprocess
import sys
import threading

import pytest

from analysis.support.files import whole_file, write_text
from tests.crowds import two_people
from tests.forked import PROGRAM, in_fork, python


def test_a_link_stays_and_what_it_points_to_is_replaced(tmp_path):
    target, link = tmp_path / "real.csv", tmp_path / "link.csv"
    target.write_text("earlier")
    link.symlink_to(target)
    write_text(link, "now")
    assert link.is_symlink()
    assert target.read_text() == "now"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["link.csv", "real.csv"]


def test_a_pipe_stays_a_pipe(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    write_text(pipe, "through")
    reader.join(10)
    assert read == ["through"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_the_command_writes_its_rows_to_a_device(alone, tmp_path):
    (tmp_path / "touch.dump").write_text(two_people())
    made = alone("solve", "touch.dump", "--time-step", 1, "--out", "/dev/stdout")
    assert made.returncode == 0, made.stderr
    assert made.stdout.startswith("time_s,first,second")
    assert ",75," in made.stdout or ",75.0" in made.stdout


def test_a_folder_is_named(tmp_path):
    (tmp_path / "taken").mkdir()
    with pytest.raises(IsADirectoryError, match="taken"):
        write_text(tmp_path / "taken", "now")


def test_a_failed_write_leaves_what_was_there_and_names_the_file(tmp_path):
    path = tmp_path / "numbers.csv"
    path.write_text("earlier")
    with pytest.raises(OSError, match=r"numbers\.csv") as caught, whole_file(path):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert caught.value.errno == errno.ENOSPC
    assert path.read_text() == "earlier"
    assert [path.name for path in tmp_path.iterdir()] == ["numbers.csv"]


WARNS = "import warnings; warnings.warn('divide by zero', RuntimeWarning)"


def warning_in_a_fork():
    print("file.py:3: DeprecationWarning: old", file=sys.stderr)  # noqa: T201
    return 0


def test_printed_warning_fails_the_test_that_started_the_command():
    for text in (True, False):
        with pytest.raises(pytest.fail.Exception, match="RuntimeWarning: divide by zero"):
            subprocess.run([sys.executable, "-c", WARNS], capture_output=True, text=text)
    with pytest.raises(pytest.fail.Exception, match="DeprecationWarning: old"):
        in_fork(warning_in_a_fork, 10)


def test_characters_that_the_terminal_lacks_do_not_end_a_command():
    done = python(PROGRAM, "scenes", PYTHONIOENCODING="ascii")
    assert done.returncode == 0, done.stderr
    assert "?f dt against p" in done.stdout
