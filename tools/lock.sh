#!/bin/sh
# Write the lock files anew from pyproject.toml: the newest versions that it allows, for Python 3.12 and later.
set -eu
cd "$(dirname "$0")/.."
uv=$(command -v uv || echo .venv/bin/uv)
[ -x "$uv" ] || { echo "Locking needs uv: pip install uv" >&2; exit 1; }

lock() {
    output=$1
    shift
    "$uv" pip compile pyproject.toml "$@" --group build --universal --python-version 3.12 --generate-hashes --upgrade \
        --no-emit-index-url --no-header --quiet --output-file "$output" >/dev/null
}
lock requirements.lock --extra tdms --extra office --group dev --group docs
lock requirements-bench.lock --extra bench
