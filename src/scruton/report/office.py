"""What Word and Excel files share: the packages that write them, and files that are the same for the same report."""

import io
import re
import zipfile
from importlib.util import find_spec

from scruton.errors import InputError

PACKAGES = {"docx": ("docx", "python-docx"), "xlsx": ("openpyxl", "openpyxl")}  # by format: module, and its package
_EPOCH = (1980, 1, 1, 0, 0, 0)  # the first that a zip file knows
_SAVED = re.compile(rb"(<dcterms:(?:created|modified)[^>]*>)[^<]*")
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ufffe\uffff\ud800-\udfff]")


def check_office(form: str, option: str) -> None:
    """Refuse a format whose package is not installed, before any work is done (InputError)."""
    if form not in PACKAGES:
        raise InputError("report", option, f'"{form}"', f"one of: {', '.join(PACKAGES)}")
    module, package = PACKAGES[form]
    if find_spec(module) is None:
        raise InputError(
            "command line", option, f"no package that writes .{form} files",
            f"{package}: pip install 'scruton[office]'",
        )  # fmt: skip


def same_bytes(content: bytes) -> bytes:
    """The file without the moments at which it was made: the same report gives the same bytes."""
    stream = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(content)) as old,
        zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as new,
    ):
        for name in old.namelist():
            data = old.read(name)
            if name == "docProps/core.xml":
                data = _SAVED.sub(rb"\g<1>1980-01-01T00:00:00Z", data)
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            new.writestr(entry, data)
    return stream.getvalue()


def plain(text: str) -> str:
    """A text without the characters that XML cannot hold."""
    return _CONTROL.sub("", text)
