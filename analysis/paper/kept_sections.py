"""Sections kept on disk, so that an interrupted build goes on where it was and an unchanged one is
not made again."""

from __future__ import annotations

import hashlib
import io
import json
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import analysis
import nscd
from analysis.pages.section import Claim, Drawn, Picture, Section, Table, Verdict
from analysis.support.files import write_text

NAME = "section.json"
LIBRARIES = ("numpy", "scipy", "scikit-fem", "netgen-mesher", "matplotlib", "numba")


@cache
def edition() -> str:
    """What the numbers of a section depend on: a digest of the sources of nscd and analysis, and
    the libraries' versions."""
    digest = hashlib.sha256(
        " ".join(f"{name} {metadata.version(name)}" for name in LIBRARIES).encode()
    )
    for package in (nscd, analysis):
        root = Path(package.__path__[0])
        for path in sorted(root.rglob("*.py")):
            digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.hexdigest()


def keep(section: Section, cpu_seconds: float, folder: Path, made_by: str) -> None:
    """Write the section's pictures as PNG and PDF, then everything else as `section.json`; made_by:
    the edition."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = [drawn_of(picture) for picture in section.pictures]
    for picture in drawn:
        (folder / f"{picture.name}.png").write_bytes(picture.png)
        (folder / f"{picture.name}.pdf").write_bytes(picture.pdf)
    content = {
        "edition": made_by,
        "cpu_seconds": cpu_seconds,
        "number": section.number,
        "title": section.title,
        "words": list(section.words),
        "differs": list(section.differs),
        "warnings": list(section.warnings),
        "pictures": [{"name": picture.name, "caption": picture.caption} for picture in drawn],
        "tables": [
            {"caption": t.caption, "head": list(t.head), "rows": [list(row) for row in t.rows]}
            for t in section.tables
        ],
        "claims": [
            {
                "where": c.where,
                "statement": c.statement,
                "verdict": str(c.verdict),
                "reason": c.reason,
            }
            for c in section.claims
        ],
    }
    # last, so that it stands for files that are whole
    write_text(
        folder / NAME, json.dumps(content, ensure_ascii=False, indent=1, default=_plain) + "\n"
    )


def kept(folder: Path) -> tuple[Section, float] | None:
    """The section of this edition from `folder` and the CPU seconds that it took; None where there
    is none."""
    try:
        content = json.loads((folder / NAME).read_text(encoding="utf-8"))
        if content["edition"] != edition():
            return None
        section = Section(
            number=content["number"],
            title=content["title"],
            words=content["words"],
            differs=content["differs"],
            warnings=content["warnings"],
            pictures=[
                Drawn(
                    **picture,
                    png=(folder / f"{picture['name']}.png").read_bytes(),
                    pdf=(folder / f"{picture['name']}.pdf").read_bytes(),
                )
                for picture in content["pictures"]
            ],
            tables=[Table(**table) for table in content["tables"]],
            claims=[
                Claim(**claim | {"verdict": Verdict(claim["verdict"])})
                for claim in content["claims"]
            ],
        )
        return section, float(content["cpu_seconds"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def drawn_of(picture: Picture | Drawn) -> Drawn:
    """The picture as bytes, without the date, so that the same picture is the same file."""
    if isinstance(picture, Drawn):
        return picture
    files = {}
    for suffix, hidden in (("png", {}), ("pdf", {"CreationDate": None})):
        buffer = io.BytesIO()
        picture.figure.savefig(buffer, format=suffix, dpi=150, metadata=hidden)
        files[suffix] = buffer.getvalue()
    return Drawn(name=picture.name, caption=picture.caption, **files)


def _plain(value: Any) -> Any:
    """A numpy number as Python's."""
    return value.item()
