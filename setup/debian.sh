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

needed=()
optional=()
for package in "${missing[@]}"; do
    if [[ $package == *\? ]]; then optional+=("${package%\?}"); else needed+=("$package"); fi
done

by_hand() { # by_hand WHY: ends; what can be done without stops nobody
    [ ${#needed[@]} -gt 0 ] || exit 0
    echo "Debian packages are missing, and $1. Install them as root, then run make again:" >&2
    echo "    apt-get install ${needed[*]}" >&2
    [ ${#optional[@]} -eq 0 ] || echo "Some tests also use: ${optional[*]}" >&2
    exit 1
}

if ! command -v apt-get >/dev/null; then
    [ ${#needed[@]} -gt 0 ] || exit 0
    echo "These are missing, and this system has no apt-get; install what your system calls them:" >&2
    printf '    %s\n' "${needed[@]}" >&2
    exit 1
fi
as_root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || by_hand "you are not root and have no sudo"
    echo "missing: ${needed[*]} ${optional[*]}"
    echo "sudo installs them, and may ask for your password"
    as_root=(sudo)
fi
"${as_root[@]}" apt-get update -qq || by_hand "apt-get update failed"
wanted=()
for package in "${missing[@]}"; do
    if [[ $package != *\? ]]; then
        wanted+=("$package")
    elif apt-cache policy "${package%\?}" | grep -q 'Candidate: [0-9]'; then
        wanted+=("${package%\?}")
    fi
done
[ ${#wanted[@]} -gt 0 ] || exit 0
echo "installing: ${wanted[*]} (waits up to five minutes while another apt runs)"
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get -o DPkg::Lock::Timeout=300 install -y -qq --no-install-recommends "${wanted[@]}" >/dev/null </dev/null || by_hand "apt-get install failed"
