"""Where every number comes from: command, seed, versions, digests of what was read, the model card."""

from collections.abc import Iterator

from scruton.report.chapters.material import Material, chapter
from scruton.report.document import Block, Definitions, Heading, Table, Verbatim, paragraph


@chapter("provenance", "Provenance")
def provenance_chapter(material: Material) -> Iterator[Block]:
    """Everything that is needed to make the same numbers again."""
    found = material.fit.summary["provenance"]
    card = found["card"]
    versions = ", ".join(f"{name} {version}" for name, version in sorted(found["versions"].items()))
    yield Definitions(
        (
            ("Command", str(found["command"] or "not recorded")),
            ("Seed", str(found["seed"])),
            ("Versions", versions),
            (
                "Tables",
                "tables/NAME.csv (numbers unrounded where there are more digits) and tables/NAME.tex (as shown)",
            ),
            ("Figures", "figures/NAME.svg and figures/NAME.png"),
            ("All numbers", "report.json"),
        )
    )
    digests = {**found["sha256"], **(material.sizing or {}).get("provenance", {}).get("bridge_sha256", {})}
    if digests:
        rows = tuple(sorted(digests.items()))
        yield Heading("Files read")
        yield Table("digests", "SHA-256 of every file read", ("file", "SHA-256"), rows, numeric=(False, False))
    yield Heading(f"Model card “{card['name']}”")
    yield paragraph(f"SHA-256 {card['sha256']}", role="note")
    yield Verbatim(str(card["text"]).rstrip("\n"))
