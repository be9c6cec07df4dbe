"""Render the report of every shipped example into reports/: NAME.html and NAME.pdf."""

import shutil
from pathlib import Path

from scruton.app.report import run_report

if __name__ == "__main__":
    for campaign in sorted(Path("examples").glob("*/campaign.toml")):
        folder = campaign.parent
        bridge = folder / "bridge.toml"
        out = Path("out/reports") / folder.name
        _, paths = run_report(folder, out, bridge=bridge if bridge.exists() else None, force=True)
        if paths.pdf is None or paths.failures:
            raise SystemExit("\n".join(f"{folder.name}: {one.sentence}" for one in paths.failures))
        for path in (paths.report, paths.pdf):
            print(shutil.copy(path, Path("reports") / f"{folder.name}{path.suffix}"))
