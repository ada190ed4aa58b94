#!/usr/bin/env bash
# Looks for what no fixed seed shows: property tests and fuzz targets from fresh seeds, in rotation, for as long as
# told. Then it compares a commissioned map and the pages of results with new runs, and the dependencies with deny.toml,
# which takes minutes.
#
#   tests/soak.sh [MINUTES]
#
# 60 minutes unless told otherwise; builds and the pages come on top. Prints each seed and, at a failure, the command
# that repeats it, and goes on with the others. What it finds stays in out/soak. Exits with 1 if something failed.
set -euo pipefail
cd "$(dirname "$0")/.."

minutes=${1:-60}
if ! [[ $minutes =~ ^[0-9]+$ ]] || ((minutes < 1)); then
    echo "tests/soak.sh: $minutes: expected minutes, 1 or more" >&2
    exit 2
fi

# Every second round draws more cases than the tests do by themselves.
more_cases=2048
# One property test, and one turn of a fuzz target, in s.
property_limit_s=300
fuzz_turn_s=60
# A test that fails so often is left out of later rounds.
failures_max=3

found=out/soak
mkdir -p "$found"
found=$(cd "$found" && pwd)
runs=$found/runs.tsv
failures=$found/failures.txt
: >"$runs"
: >"$failures"

heading() { printf '\n== %s (%d s)\n' "$*" "$SECONDS"; }
fresh_seed() { od -An -N8 -tu8 /dev/urandom | tr -d ' '; }

# Once: NAME SEED SECONDS RESULT. Tabs, for the table at the end.
note() { printf '%s\t%s\t%s\t%s\n' "$@" >>"$runs"; }

# A failure: what failed, where its output is, and the command that repeats it.
failed() {
    local what=$1 log=$2 repeat=$3
    printf 'FAILED %s\n    output: %s\n    repeat: %s\n' "$what" "$log" "$repeat" | tee -a "$failures"
}
given_up() { (($(awk -F'\t' -v name="$1" '$1 == name && $4 == "failed"' "$runs" | wc -l) >= failures_max)); }

heading "tools"
if ! command -v cargo-fuzz >/dev/null; then
    cargo install cargo-fuzz --locked
fi
cargo fuzz --version

heading "property tests are built"
mapfile -t sources < <(git ls-files --cached --others --exclude-standard '*.rs' | xargs grep -l 'proptest!')
names=$(awk -f tests/property_tests.awk "${sources[@]}" | sort -u)
artifacts=$found/artifacts.json
cargo test --workspace --exclude fuzz --exclude micromotor-python --features tests/peers \
    --lib --bins --tests --no-run --message-format json-render-diagnostics >"$artifacts"
cargo clippy --package micromotor-sim --all-targets --features peers -- -D warnings
cargo test --package tests --features peers --test system -- command::tool_accuracy
# FOLDER BINARY: a package's folder, and a test binary of it. An artifact is a line of JSON.
tested() { grep '"profile":{[^}]*"test":true}' "$artifacts"; }
folder='.*"manifest_path":"\([^"]*\)\/Cargo\.toml"'
binary='.*"executable":"\([^"]*\)".*'
mapfile -t binaries < <(tested | sed -n "s/$folder$binary/\1 \2/p")
if ((${#binaries[@]} == 0)); then
    echo "tests/soak.sh: the tests do not build" >&2
    exit 1
fi
# FOLDER BINARY TEST, one a line.
properties=$found/properties.txt
for line in "${binaries[@]}"; do
    "${line#* }" --list 2>/dev/null | sed -n 's/: test$//p' | awk -v names="$names" -v prefix="$line" '
        BEGIN { count = split(names, list, "\n"); for (i = 1; i <= count; i++) wanted[list[i]] = 1 }
        { name = $0; sub(/.*::/, "", name); if (name in wanted) print prefix, $0 }'
done >"$properties"
for name in $names; do
    if ! grep -q "::$name\$" "$properties"; then
        echo "tests/soak.sh: property test $name is in no test binary" >&2
        exit 1
    fi
done
echo "$(wc -l <"$properties") property tests"

heading "fuzz targets are built"
# The targets need flags of the compiler that are not stable yet; no sanitizer, since no library has unsafe code.
fuzz() { RUSTC_BOOTSTRAP=1 cargo fuzz "$1" --fuzz-dir tests/fuzz --sanitizer none --features link_libfuzzer "${@:2}"; }
mapfile -t targets < <(cargo fuzz list --fuzz-dir tests/fuzz)
fuzz build
echo "${#targets[@]} fuzz targets: ${targets[*]}"

end=$((SECONDS + 60 * minutes))
left() { echo $((end - SECONDS)); }

# One property test from one seed.
property() {
    local folder=$1 binary=$2 name=$3 seed=$4 cases=$5 package limit log began status=0 result=passed
    package=$(basename "$folder")
    limit=$(left)
    ((limit < property_limit_s)) || limit=$property_limit_s
    log=$found/$package-${name//::/.}-$seed.log
    began=$SECONDS
    local variables=("PROPTEST_RNG_SEED=$seed" PROPTEST_DISABLE_FAILURE_PERSISTENCE=1)
    [[ $cases == own ]] || variables+=("PROPTEST_CASES=$cases")
    (cd "$folder" && env "${variables[@]}" timeout "$limit" "$binary" --exact "$name") >"$log" 2>&1 || status=$?
    case $status in
    0) rm "$log" ;;
    124) result="cut short" && rm "$log" ;;
    *)
        result=failed
        failed "$package $name, seed $seed" "$log" \
            "${variables[*]} cargo test --manifest-path $folder/Cargo.toml -- --exact $name"
        ;;
    esac
    note "$package $name" "$seed" $((SECONDS - began)) "$result"
}

# Rounds over all property tests, a fresh seed each.
all_properties() {
    local round=0 seed cases folder binary name
    while (($(left) > 0)); do
        round=$((round + 1))
        seed=$(fresh_seed)
        cases=own
        ((round % 2)) || cases=$more_cases
        echo "property tests, round $round: seed $seed, cases: $cases"
        while read -r folder binary name; do
            (($(left) > 0)) || break
            given_up "$(basename "$folder") $name" || property "$folder" "$binary" "$name" "$seed" "$cases"
        done <"$properties"
    done
}

# One turn of a fuzz target from one seed.
fuzz_turn() {
    local target=$1 seed=$2 limit log began status=0 result=passed artifact
    limit=$(left)
    ((limit < fuzz_turn_s)) || limit=$fuzz_turn_s
    log=$found/fuzz-$target-$seed.log
    began=$SECONDS
    fuzz run "$target" -- -seed="$seed" -max_total_time="$limit" -timeout=30 -print_final_stats=1 >"$log" 2>&1 ||
        status=$?
    if ((status == 0)); then
        rm "$log"
    else
        result=failed
        local command="RUSTC_BOOTSTRAP=1 cargo fuzz run --fuzz-dir tests/fuzz --sanitizer none"
        command+=" --features link_libfuzzer $target"
        artifact=$(sed -n 's/.*Test unit written to \(.*\)$/\1/p' "$log" | tail -n 1)
        failed "fuzz target $target, seed $seed" "$log" "$command ${artifact:--- -seed=$seed}"
    fi
    note "fuzz $target" "$seed" $((SECONDS - began)) "$result"
}

all_targets() {
    local target seed
    while (($(left) > 0)); do
        for target in "${targets[@]}"; do
            (($(left) > 0)) || break
            given_up "fuzz $target" && continue
            # libFuzzer takes 32 bits.
            seed=$(($(fresh_seed | cut -c -9) + 1))
            echo "fuzz target $target: seed $seed"
            fuzz_turn "$target" "$seed"
        done
        sleep 1
    done
}

heading "property tests and fuzz targets, side by side for $minutes minutes"
all_properties &
properties_id=$!
all_targets &
targets_id=$!
trap 'kill "$properties_id" "$targets_id" 2>/dev/null || true' EXIT
wait "$properties_id"
wait "$targets_id"
trap - EXIT

# A check of its own: NAME COMMAND...
check() {
    local name=$1 log=$found/$1.log began=$SECONDS result=passed
    heading "$name"
    if ! "${@:2}" 2>&1 | tee "$log"; then
        result=failed
        failed "$name" "$log" "${*:2}"
    fi
    note "$name" - $((SECONDS - began)) "$result"
}
# The map by which the first command moves its motor is what commissioning makes of that motor.
commission() {
    cargo run --release --package micromotor-sim -- commission --scene set_f_plant --out "$found/commission" &&
        cmp "$found/commission/map.toml" host-sim/maps/set_f_plant.toml
}
check commission commission
check results cargo run --release --package micromotor-sim -- results --check
# Without cargo-deny on the machine it is left out: its installation takes longer than all the rest.
if command -v cargo-deny >/dev/null; then
    check dependencies cargo deny --workspace check bans licenses sources
fi

heading "summary"
awk -F'\t' '
    { runs[$1]++; seconds[$1] += $3; if ($4 == "failed") failed[$1]++; if ($4 == "cut short") cut[$1]++ }
    END {
        printf "%-95s %6s %8s %10s %7s\n", "test", "runs", "seconds", "cut short", "failed"
        for (name in runs)
            printf "%-95s %6d %8d %10d %7d\n", name, runs[name], seconds[name], cut[name], failed[name] | "sort"
    }' "$runs"
if [[ -s $failures ]]; then
    echo
    cat "$failures"
    exit 1
fi
echo "nothing failed"
