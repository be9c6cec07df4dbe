"""What a user meets before any computation: the import, the help, the public names, the set-up script."""

import ast
import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import scruton

ROOT = Path(__file__).resolve().parents[1]
HEAVY = ("arviz", "emcee", "h5py", "matplotlib", "numba", "numpy", "pandas", "pint", "scipy", "xarray")


def loaded_by(code: str) -> set[str]:
    """Names of the modules that a fresh interpreter has loaded after `code`."""
    printed = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys\nprint('MODULES', *sys.modules)"],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    return set(printed.split("MODULES ")[1].split())


def test_import_loads_nothing_heavy():
    assert loaded_by("import scruton").isdisjoint(HEAVY)


def test_a_check_loads_neither_pandas_nor_pint(small_campaign):
    code = f"from scruton.cli import main\nassert main(['check', {str(small_campaign)!r}]) == 0"
    assert loaded_by(code).isdisjoint({"arviz", "emcee", "h5py", "matplotlib", "numba", "pandas", "pint", "xarray"})


def test_this_test_would_see_a_heavy_import():
    assert "numpy" in loaded_by("import scruton\nscruton.Campaign")


def test_help_loads_nothing_heavy():
    code = "from scruton.cli import main\ntry:\n    main(['--help'])\nexcept SystemExit:\n    pass"
    assert loaded_by(code).isdisjoint(HEAVY)


@pytest.mark.parametrize("command", ["check", "fit", "predict", "report", "simulate"])
def test_every_command_has_help_and_the_common_options(command):
    shown = subprocess.run(
        [sys.executable, "-m", "scruton", command, "--help"], capture_output=True, text=True, check=True
    ).stdout
    assert "--seed" in shown
    assert "--quiet" in shown


@pytest.mark.parametrize("name", scruton.__all__)
def test_public_name_resolves(name):
    assert getattr(scruton, name) is not None
    assert name in dir(scruton)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'griffin_plto'"):
        _ = scruton.griffin_plto


def test_the_stub_says_what_the_module_does():
    tree = ast.parse((ROOT / "src/scruton/__init__.pyi").read_text(encoding="utf-8"))
    stated = {alias.name: node.module for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert stated == scruton._HOMES


@pytest.mark.parametrize("lock", ["requirements.lock", "requirements-bench.lock"])
def test_locks_pin_by_hash_and_name_no_index(lock):
    text = (ROOT / lock).read_text(encoding="utf-8")
    assert text.count("==") <= text.count("--hash=sha256:")
    assert "://" not in text
    assert "setuptools==" in text  # the package itself is built without isolation


def fake_python(path: Path, body: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{body}\n", encoding="utf-8")
    path.chmod(0o755)
    return path


def set_up(tmp_path: Path, *, home: Path, path: Path, **more: str) -> subprocess.CompletedProcess[str]:
    """Run the set-up script where only the interpreters under `path` and `home` are to be found."""
    for tool in ("sh", "ls", "awk", "sort", "cut", "dirname", "cat", "env"):
        real = next(Path(d) / tool for d in os.environ["PATH"].split(os.pathsep) if (Path(d) / tool).exists())
        link = path / tool
        if not link.exists():
            link.symlink_to(real)
    return subprocess.run(
        ["sh", str(ROOT / "tools/setup.sh"), str(tmp_path / "venv"), "requirements.lock"],
        capture_output=True, text=True, check=False, env={"HOME": str(home), "PATH": str(path), **more},
    )  # fmt: skip


# A stand-in for an interpreter: read the probe from standard input, answer; else say who was asked to make the venv.
GOOD = 'case "$1" in -) cat >/dev/null; echo good;; -c) echo 3.x;; *) echo "$0" "$@"; exit 7;; esac'
OLD = 'case "$1" in -) cat >/dev/null; echo "is Python 3.11";; esac'
NO_VENV = 'case "$1" in -) cat >/dev/null; echo "lacks ensurepip";; esac'
SHIM = "cat >/dev/null; exit 127"


def test_set_up_finds_the_newest_in_pyenv_where_python3_is_old(tmp_path):
    home, path = tmp_path / "home", tmp_path / "bin"
    fake_python(path / "python3", OLD)
    fake_python(path / "python3.13", SHIM)  # pyenv's shim of a version that is not active
    versions = home / ".pyenv/versions"
    for version, body in {"3.11.7": OLD, "3.12.9": GOOD, "3.12.10": GOOD, "3.13.0": NO_VENV}.items():
        fake_python(versions / version / "bin/python3", body)
    ran = set_up(tmp_path, home=home, path=path)
    assert ran.returncode == 7, ran.stderr
    assert str(versions / "3.12.10/bin/python3") in ran.stdout


def test_set_up_takes_a_newer_one_on_the_path(tmp_path):
    home, path = tmp_path / "home", tmp_path / "bin"
    fake_python(path / "python3.14", GOOD)
    fake_python(home / ".pyenv/versions/3.13.1/bin/python3", GOOD)
    ran = set_up(tmp_path, home=home, path=path)
    assert ran.returncode == 7, ran.stderr
    assert str(path / "python3.14") in ran.stdout


def test_set_up_takes_the_one_that_is_named(tmp_path):
    home, path = tmp_path / "home", tmp_path / "bin"
    fake_python(path / "python3.14", GOOD)
    other = fake_python(tmp_path / "mine", GOOD)
    ran = set_up(tmp_path, home=home, path=path, PYTHON=str(other))
    assert ran.returncode == 7, ran.stderr
    assert str(other) in ran.stdout


def test_set_up_says_what_to_install(tmp_path):
    home, path = tmp_path / "home", tmp_path / "bin"
    fake_python(path / "python3", OLD)
    fake_python(path / "python3.12", NO_VENV)
    ran = set_up(tmp_path, home=home, path=path)
    assert ran.returncode == 1
    assert "apt install python3.12 python3.12-venv" in ran.stderr
    assert "python3.12 lacks ensurepip" in ran.stderr
    assert "python3 is Python 3.11" in ran.stderr
    assert not (tmp_path / "venv").exists()


# What `tools/bare.sh` shows a command, printed by that command.
SEEN = """
import json, os, shutil
from pathlib import Path
names = ("chromium", "pdftotext", "fc-list", "git", "make", "sh")
folders = [one for one in ("/usr/share/fonts", "/usr/local/share/fonts") if os.path.isdir(one)]
print(json.dumps({
    "home": os.listdir(Path.home()), "tools": [one for one in names if shutil.which(one)],
    "variables": sorted(os.environ), "typefaces": [one for folder in folders for one in os.listdir(folder)],
}))
"""


def bare(*command: str, **more: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(ROOT / "tools/bare.sh"), *command], capture_output=True, text=True, check=False, env=os.environ | more
    )


def test_a_bare_machine_has_no_more_than_the_readme_asks_for():
    ran = bare(sys.executable, "-c", SEEN, OF_THE_CALLER="1", OPENBLAS_CORETYPE="Haswell")
    assert ran.returncode == 0, ran.stderr
    seen = json.loads(ran.stdout)
    assert seen["home"] == []
    assert seen["tools"] == ["make", "sh"]
    of_the_processor = {"OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE"}
    assert set(seen["variables"]) <= {"HOME", "PATH", "PWD", "LC_CTYPE", *of_the_processor}
    assert seen["typefaces"] == [] or "cannot be covered" in ran.stderr


def test_the_result_of_a_command_on_a_bare_machine_is_its_own():
    assert bare("sh", "-c", 'test "$1" = "two words" && exit 3', "sh", "two words").returncode == 3


def test_every_package_that_is_imported_is_declared_by_name():
    """Not only what another one brings with it."""
    imported = set()
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                imported |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                imported.add(node.module.partition(".")[0])
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    stated = [project["project"]["dependencies"], *project["project"]["optional-dependencies"].values()]
    lines = [*(line for group in stated for line in group), *project["dependency-groups"]["dev"]]
    declared = {re.match(r"[\w-]+", line)[0].replace("-", "_").lower() for line in lines}
    other = {"docx": "python_docx"}
    third = {other.get(name, name).lower() for name in imported - sys.stdlib_module_names - {"scruton"}}
    assert third - declared == set()
