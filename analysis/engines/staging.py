"""The folder in which an engine works: results appear whole, or the earlier ones stay."""

from __future__ import annotations

import contextlib
import fcntl
import logging
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from analysis.engines.guard import RunStoppedError
from analysis.engines.record import FAILED, STOPPED, EngineError, RunRecord

_log = logging.getLogger(__name__)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Be the only one who runs into this folder; wait for another process that does."""
    folder = folder.resolve()
    folder.parent.mkdir(parents=True, exist_ok=True)
    path = folder.with_name(f".{folder.name}.lock")
    while True:
        file = path.open("w")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            _log.warning("%s: another process runs into this folder; waiting for it", folder)
            fcntl.flock(file, fcntl.LOCK_EX)
        # who had it before has taken the file away
        if path.exists() and os.path.samestat(os.fstat(file.fileno()), path.stat()):
            break
        file.close()
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        file.close()


@contextlib.contextmanager
def staged(folder: Path, resume: RunRecord | None = None) -> Iterator[Path]:
    """Make an empty hidden folder beside `folder` for the block to work in.

    When the block ends well it becomes `folder`; when it does not (an error, Ctrl-C), it is removed
    and `folder` stays as it was. A run that was stopped or failed becomes `folder` too, with the
    reason in its record, where no finished run is there. To be used while the folder is locked.

    resume: the record of a run that can go on where it was interrupted: the hidden folder then
        stays when the block is interrupted, and is taken again for the same record"""
    folder = folder.resolve()  # a link to a folder stays
    staging = folder.with_name(f".{folder.name}.next")
    earlier = folder.with_name(f".{folder.name}.earlier")
    if earlier.exists() and not folder.exists():
        earlier.rename(folder)  # a process was killed between the two renames of `_publish`
    if resume is None or _record_in(staging) != resume:
        shutil.rmtree(staging, ignore_errors=True)
    staging.mkdir(parents=True, exist_ok=True)
    interrupted = False
    try:
        try:
            yield staging
        except RunStoppedError as end:
            if not _holds_results(folder):
                end.record.write(staging)
                _publish(staging, folder)
            raise
        _publish(staging, folder)
    except OSError as error:
        if str(staging) in str(error.filename):  # a name that will be gone
            error.filename = str(error.filename).replace(str(staging), str(folder))
        raise
    except KeyboardInterrupt:
        interrupted = True
        raise
    finally:
        if not (interrupted and resume is not None):
            shutil.rmtree(staging, ignore_errors=True)


def _record_in(folder: Path) -> RunRecord | None:
    try:
        return RunRecord.read(folder)
    except EngineError:
        return None


def _publish(staging: Path, folder: Path) -> None:
    earlier = folder.with_name(f".{folder.name}.earlier")
    shutil.rmtree(earlier, ignore_errors=True)
    if folder.exists():
        folder.rename(earlier)
    staging.rename(folder)
    shutil.rmtree(earlier, ignore_errors=True)


def _holds_results(folder: Path) -> bool:
    """Whether there is anything that a stopped run must not replace: all but another stopped
    run."""
    try:
        return RunRecord.read(folder, even_stopped=True).exit_state not in (STOPPED, FAILED)
    except EngineError:
        return folder.exists()
