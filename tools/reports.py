"""Render the report of every shipped example into reports/: NAME.html and NAME.pdf."""

import shutil
from pathlib import Path

from scruton.cli import main
from scruton.documents import read_json

if __name__ == "__main__":
    for campaign in sorted(Path("examples").glob("*/campaign.toml")):
        folder = campaign.parent
        bridge = folder / "bridge.toml"
        out = Path("out/reports") / folder.name
        beside = ["--bridge", str(bridge)] if bridge.exists() else []
        main(["report", str(folder), "-o", str(out), "--quiet", "--force", *beside])
        if failures := read_json(out / "report.json")["failures"]:
            raise SystemExit("\n".join(f"{folder.name}: {failure['sentence']}" for failure in failures))
        for kind in ("html", "pdf"):
            print(shutil.copy(out / f"report.{kind}", Path("reports") / f"{folder.name}.{kind}"))
