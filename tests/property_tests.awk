# Names of the property tests in Rust sources: the functions of each `proptest!` block, one a line.
# A file with a block that shows none is an error: the block is written in a way that this script does not read.

FNR == 1 { finish(); inside = 0; blocks = 0; names = 0; file = FILENAME }
/^[ ]*proptest! \{$/ { inside = 1; blocks++; match($0, /^ */); indent = RLENGTH; next }
inside && /^ *\}$/ { match($0, /^ */); if (RLENGTH == indent) inside = 0; next }
inside && /^ *fn [a-z0-9_]+\(/ {
    match($0, /^ */)
    if (RLENGTH == indent + 4) { sub(/^ *fn /, ""); sub(/\(.*/, ""); print; names++ }
}
END { finish(); exit wrong }

function finish() {
    if (blocks > 0 && names == 0) { print file ": a proptest! block without a test" > "/dev/stderr"; wrong = 1 }
}
