"""The folder in which a test writes its campaign."""

from pathlib import Path

import pytest
from campaign_room import Room


@pytest.fixture
def room(tmp_path: Path) -> Room:
    folder = tmp_path / "campaign"
    folder.mkdir()
    return Room(folder)
