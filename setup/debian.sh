#!/usr/bin/env bash
# debian.sh LIST...: installs the packages of setup/debian.txt whose probe finds nothing.
# Asks apt only when something is missing; elsewhere than on Debian it prints what is missing and stops.
set -eu
here=$(dirname "$0")
python=${PYTHON:-python3}

found() { # found KIND:NAME
    case $1 in
    command:*) command -v "${1#*:}" >/dev/null ;;
    pkg:*) command -v pkg-config >/dev/null && pkg-config --exists "${1#*:}" ;;
    python:*) "$python" -c "import ${1#*:}" 2>/dev/null ;;
    library:*) { ldconfig -p || /sbin/ldconfig -p; } 2>/dev/null | grep -q "${1#*:}" ;;
    header:python3*) [ -e "$("$python" -c 'import sysconfig; print(sysconfig.get_path("include"))' 2>/dev/null)/Python.h" ] ;;
    header:*) compgen -G "/usr/include/${1#*:}" >/dev/null || compgen -G "/usr/include/*/${1#*:}" >/dev/null ||
        compgen -G "/usr/local/include/${1#*:}" >/dev/null ;;
    file:*) compgen -G "/usr/lib/${1#*:}" >/dev/null ;;
    *) echo "setup/debian.txt: '$1' is no probe" >&2; exit 2 ;;
    esac
}

missing=()
for list in "$@"; do
    while read -r of probe package; do
        [ "$of" = "$list" ] || continue
        found "$probe" || missing+=("$package")
    done <"$here/debian.txt"
done
[ ${#missing[@]} -gt 0 ] || exit 0

if ! command -v apt-get >/dev/null; then
    wanted=()
    for package in "${missing[@]}"; do
        [[ $package == *\? ]] || wanted+=("$package")
    done
    [ ${#wanted[@]} -gt 0 ] || exit 0
    echo "These are missing, and this system has no apt-get; install what your system calls them:" >&2
    printf '    %s\n' "${wanted[@]}" >&2
    exit 1
fi
as_root=()
if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
        echo "These are missing; install them as root: apt-get install ${missing[*]%\?}" >&2
        exit 1
    fi
    as_root=(sudo)
fi
"${as_root[@]}" apt-get update -qq
wanted=()
for package in "${missing[@]}"; do
    if [[ $package != *\? ]]; then
        wanted+=("$package")
    elif apt-cache policy "${package%\?}" | grep -q 'Candidate: [0-9]'; then
        wanted+=("${package%\?}")
    fi
done
missing=("${wanted[@]}")
[ ${#missing[@]} -gt 0 ] || exit 0
echo "installing: ${missing[*]}"
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
