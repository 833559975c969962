#!/usr/bin/env bash
# step.sh NAME COMMAND...: runs one step of setup. Says every few seconds how far it is (the last [34/169] of ninja) and at
# the end how long it took. All that it prints goes to build/setup/NAME.log; where it fails, the end of that is shown.
set -u
name=$1
shift
every=5
log=build/setup/${name//[ \/]/-}.log
mkdir -p build/setup
echo "$name"
"$@" </dev/null 2>&1 | tee "$log" | {
    next=$every at=
    while read -r -t "$every" line || [ $? -gt 128 ]; do # 128 and more: no line for so long
        [[ $line =~ \[[0-9]+/[0-9]+\] ]] && at="${BASH_REMATCH[0]}, "
        if ((SECONDS >= next)); then
            echo "$name: $at$SECONDS s"
            next=$((SECONDS + every))
        fi
    done
}
code=${PIPESTATUS[0]}
if [ "$code" -ne 0 ]; then
    echo "$name failed after $SECONDS s. All that it printed is in $log, the end of it:" >&2
    tail -n 40 "$log" >&2
    exit "$code"
fi
echo "$name: done in $SECONDS s"
