"""Where every number comes from: command, seed, versions, digests of what was read, the model card."""

from scruton.report.chapters.material import Material
from scruton.report.document import Block, Chapter, Definitions, Heading, Paragraph, Table, Verbatim


def provenance_chapter(material: Material) -> Chapter:
    """Everything that is needed to make the same numbers again."""
    found = material.fit.summary["provenance"]
    versions = ", ".join(f"{name} {version}" for name, version in sorted(found["versions"].items()))
    pairs = [
        ("Command", str(found["command"] or "not recorded")),
        ("Seed", str(found["seed"])),
        ("Versions", versions),
        ("Tables", "tables/NAME.csv (numbers unrounded where there are more digits) and tables/NAME.tex (as shown)"),
        ("Figures", "figures/NAME.svg and figures/NAME.png"),
        ("All numbers", "report.json"),
    ]
    blocks: list[Block] = [Definitions(tuple(pairs))]
    digests = {**found["sha256"], **(material.sizing or {}).get("provenance", {}).get("bridge_sha256", {})}
    if digests:
        rows = tuple((name, digest) for name, digest in sorted(digests.items()))
        blocks += [
            Heading("Files read"),
            Table("digests", "SHA-256 of every file read", ("file", "SHA-256"), rows, numeric=(False, False)),
        ]
    card = found["card"]
    blocks += [
        Heading(f"Model card “{card['name']}”"),
        Paragraph((f"SHA-256 {card['sha256']}",), role="note"),
        Verbatim(str(card["text"]).rstrip("\n")),
    ]
    return Chapter("provenance", "Provenance", tuple(blocks))
