"""Keeps YADE from opening network ports: `yade -L noserver …` with this folder on PYTHONPATH.

YADE starts a Python prompt and an XML-RPC server on all interfaces before it runs a script.
Imported first (-L), this file puts itself in the place of the module that does so."""

import importlib.util
import sys

REPLACED = "yade.remote"


class _Replacement:
    @staticmethod
    def find_spec(name, path=None, target=None):
        return importlib.util.spec_from_file_location(name, __file__) if name == REPLACED else None


def runServers():  # noqa: N802  (YADE's name)
    """Start nothing."""


if __name__ != REPLACED:
    sys.meta_path.insert(0, _Replacement)
