"""Keeps YADE from opening network ports: `yade -L noserver …` with this folder on PYTHONPATH.

YADE starts a Python prompt and an XML-RPC server on all interfaces before it runs a script.
Imported first (-L), this file puts itself in the place of the module that does so. With -x YADE
ends with the script, and nobody sees the prompt that it makes ready before, which takes nearly half
of its start: then it puts itself in the place of IPython too."""

import importlib.util
import sys

REPLACED = "yade.remote"
PROMPT = ("IPython", "IPython.Shell", "IPython.ipapi") if "-x" in sys.argv else ()
# the oldest that YADE takes; of that it asks the names below only
__version__ = "0.10"
__path__ = ()


class _Replacement:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name in (REPLACED, *PROMPT):
            return importlib.util.spec_from_file_location(name, __file__)
        return None


def runServers():  # noqa: N802  (YADE's name)
    """Start nothing."""


class IPShellEmbed:
    """No prompt: IPython.Shell.IPShellEmbed, and what IPython.ipapi gives."""

    def __init__(self, banner="", rc_override=None):
        """Make nothing ready."""

    def atexit_operations(self):
        """Keep no history."""


def get():
    """What IPython.ipapi.get gives, of which YADE asks `IP`."""
    found = IPShellEmbed()
    found.IP = found
    return found


if __name__ == "noserver":
    sys.meta_path.insert(0, _Replacement)
