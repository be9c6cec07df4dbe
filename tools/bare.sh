#!/bin/sh
# Run a command as on a bare machine: tools/bare.sh COMMAND...
# Only what README.md asks for is on PATH, HOME is an empty folder, no variable of the caller's is left, and no typeface
# of the machine is to be seen. To cover their folders takes a kernel that lets a user mount something for himself;
# where it does not, that no typeface of theirs is used is for the tests of typefaces alone to show.
set -eu

TOOLS="make sh awk cat chmod cp cut dirname env find ln ls mkdir mktemp rm rmdir sort touch"
FOLDERS="/usr/share/fonts /usr/local/share/fonts /usr/share/texmf /usr/share/texlive /usr/X11R6/lib/X11/fonts"

place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
mkdir "$place/bin" "$place/home"
for tool in $TOOLS; do
    path=$(command -v "$tool") || { echo "tools/bare.sh needs $tool" >&2; exit 1; }
    ln -s "$path" "$place/bin/$tool"
done

there=
for folder in $FOLDERS; do
    [ ! -d "$folder" ] || there="$there $folder"
done
cover='for one in $0; do mount -t tmpfs none "$one" || exit 125; done'
seclude=
if [ -n "$there" ]; then
    if unshare --mount sh -c "$cover" "$there" 2>/dev/null; then
        seclude="unshare --mount"
    elif unshare --user --map-root-user --mount sh -c "$cover" "$there" 2>/dev/null; then
        seclude="unshare --user --map-root-user --mount"
    else
        echo "tools/bare.sh: the folders of typefaces cannot be covered here:$there" >&2
    fi
fi

# Which kernels an old OpenBLAS may use on this processor is a property of the machine, not of the caller.
set -- env -i HOME="$place/home" PATH="$place/bin" \
    ${OPENBLAS_CORETYPE:+OPENBLAS_CORETYPE="$OPENBLAS_CORETYPE"} \
    ${OPENBLAS_L2_SIZE:+OPENBLAS_L2_SIZE="$OPENBLAS_L2_SIZE"} "$@"
if [ -n "$seclude" ]; then
    $seclude sh -c "$cover; exec \"\$@\"" "$there" "$@"
else
    "$@"
fi
