#!/bin/sh
# Make a virtual environment with this package in it: tools/setup.sh FOLDER LOCKFILE
# Takes the newest Python from 3.12 to 3.14 that it finds; PYTHON=/path/to/python3 chooses another.
set -eu

folder=$1
lock=$2
cd "$(dirname "$0")/.."

# One line: "good", or what is wrong with the interpreter $1. A pyenv shim without a version behind it says nothing.
verdict() {
    "$1" - 2>/dev/null <<'PYTHON' || echo "does not run"
import sys

def verdict():
    if not (3, 12) <= sys.version_info[:2] < (3, 15):
        return "is Python %d.%d" % sys.version_info[:2]
    missing = []
    for name in ("venv", "ensurepip", "ssl", "ctypes", "zlib"):
        try:
            __import__(name)
        except ImportError:
            missing.append(name)
    if missing:
        return "lacks " + ", ".join(missing)
    return "good"

print(verdict())
PYTHON
}

candidates() {
    for minor in 14 13 12; do
        command -v "python3.$minor" || true
        # Patch versions newest first: 3.12.10 before 3.12.9.
        ls -d "${PYENV_ROOT:-$HOME/.pyenv}/versions/3.$minor".*/bin/python3 2>/dev/null |
            awk -F/ '{split($(NF - 2), v, "."); print v[3] + 0 "\t" $0}' | sort -rn | cut -f 2-
    done
    command -v python3 || true
    command -v python || true
}

python=
tried=
if [ -n "${PYTHON:-}" ]; then
    found=$(verdict "$PYTHON")
    [ "$found" = good ] && python=$PYTHON || tried="  $PYTHON $found"
else
    while IFS= read -r candidate; do
        [ -n "$candidate" ] || continue
        found=$(verdict "$candidate")
        if [ "$found" = good ]; then
            python=$candidate
            break
        fi
        tried="$tried
  $candidate $found"
    done <<CANDIDATES
$(candidates)
CANDIDATES
fi

if [ -z "$python" ]; then
    cat >&2 <<MESSAGE
scruton needs Python 3.12, 3.13 or 3.14 with the modules venv and ensurepip; none was found. Tried:${tried:-
  nothing: no python3 on PATH}

Install one, for instance
  Debian, Ubuntu   apt install python3.12 python3.12-venv
  macOS            brew install python@3.13
  anywhere         pyenv install 3.13
or name one that you have: make PYTHON=/path/to/python3.13 ...
MESSAGE
    exit 1
fi

# An environment that works is kept, so that a new lock only installs what changed.
if [ -n "${PYTHON:-}" ] || [ "$(verdict "$folder/bin/python")" != good ]; then
    echo "Making $folder with $python ($("$python" -c 'import platform; print(platform.python_version())'))"
    "$python" -m venv --clear "$folder"
fi
PIP_DISABLE_PIP_VERSION_CHECK=1
export PIP_DISABLE_PIP_VERSION_CHECK
echo "Installing what $lock lists (a few minutes the first time)"
"$folder/bin/python" -m pip install --quiet --require-hashes -r "$lock"
"$folder/bin/python" -m pip install --quiet --no-deps --no-build-isolation -e .
# A machine may forbid Python to keep what it has compiled: then every command would compile the whole package anew.
"$folder/bin/python" -m compileall -q src
