#!/usr/bin/env bash
# Builds the page into target/web: Rust as WebAssembly, the JavaScript that loads it, and the files of web/page.
#
#   web/build.sh && python3 -m http.server -d target/web
#
# What takes long is kept in target/ and only built again when it changes. The compiler's target is looked for in this
# order, each attempt of bounded time:
#
#   installed  the rustup toolchain has it
#   rustup     rustup adds it
#   debian     Debian's rustc-web, cargo-web and rust-web-src, which build `std` from source
set -euo pipefail
cd "$(dirname "$0")/.."

target=wasm32-unknown-unknown
target_dir=$(cargo metadata --no-deps --format-version 1 | sed -n 's/.*"target_directory":"\([^"]*\)".*/\1/p')
page=$target_dir/web

log() { echo "web/build.sh: $*" >&2; }
as_root() { if ((EUID == 0)); then "$@"; else sudo "$@"; fi; }

target_installed() {
    [[ -d $(rustc --print sysroot)/lib/rustlib/$target/lib ]]
}

add_debian() {
    command -v apt-get >/dev/null || return 1
    as_root timeout 120 apt-get -qq update >&2 || return 1
    as_root env DEBIAN_FRONTEND=noninteractive timeout 300 \
        apt-get -qq install -y --no-install-recommends rustc-web cargo-web rust-web-src >&2
}

# Builds the module by the command given as arguments, and sets `module`. The features are those of every browser of
# the last years.
build_module() {
    CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="-C target-feature=+simd128" \
        timeout 900 "$@" build --package micromotor-web --lib --profile page --target "$target" >&2
    module=$built/$target/page/web.wasm
}

built=$target_dir
if target_installed || { command -v rustup >/dev/null && timeout 180 rustup target add "$target" >&2; }; then
    log "toolchain: $(rustc --version)"
    build_module cargo
elif add_debian; then
    log "toolchain: Debian's $(/usr/bin/rustc --version)"
    # A folder of its own, because artefacts of two compilers do not mix.
    built=$target_dir/debian
    build_module env -u CARGO -u LD_LIBRARY_PATH -u RUSTUP_TOOLCHAIN PATH="/usr/bin:$PATH" RUSTC=/usr/bin/rustc \
        RUSTC_BOOTSTRAP=1 CARGO_UNSTABLE_BUILD_STD=std,panic_abort CARGO_TARGET_DIR="$built" \
        CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER="$(rustc --print sysroot)/lib/rustlib/$(rustc -vV |
            sed -n 's/^host: //p')/bin/rust-lld" /usr/bin/cargo
else
    log "no Rust for $target: not installed, and neither rustup nor Debian's packages supplied it"
    exit 1
fi

# wasm-bindgen's own tool, as a program of this project, and the same version as in the module.
cargo build --quiet --manifest-path web/bindgen/Cargo.toml --locked --target-dir "$target_dir/bindgen" >&2
bindgen=$target_dir/bindgen/debug/bindgen

# Loader and module, made again when the compiler has written another module.
loaded=$target_dir/page/loaded
if [[ ! $loaded/web.js -nt $module || $bindgen -nt $loaded/web.js ]]; then
    rm -rf "$loaded"
    mkdir -p "$loaded/optimised"
    # Before wasm-bindgen, which adds tables of JavaScript's values: Debian's binaryen writes those in an old format.
    if command -v wasm-opt >/dev/null; then
        # The first kilobyte of memory is the end of the stack, 1 MB below its begin: nothing lies there.
        wasm-opt -Os --low-memory-unused --enable-simd --enable-bulk-memory --enable-sign-ext --enable-mutable-globals \
            --enable-nontrapping-float-to-int --enable-reference-types --enable-multivalue \
            "$module" -o "$loaded/optimised/web.wasm"
        module=$loaded/optimised/web.wasm
    else
        log "wasm-opt (binaryen) is not installed: the module stays larger than it need be"
    fi
    "$bindgen" "$module" "$loaded"
fi

mkdir -p "$page"
cp "$loaded"/web.js "$loaded"/web_bg.wasm web/page/* "$page"
# Without comments and indentation, which a sixth of the scripts is and no browser reads.
sed -E -i '/^[ \t]*\/\*.*\*\/$/d; /^[ \t]*\/\*/,/\*\//d; /^[ \t]*\/\//d; s/^[ \t]+//; /^$/d' "$page"/*.js "$page"/*.css
# The book, where it was built: its own pages stand below this one.
if [[ -d $target_dir/book ]]; then
    rm -rf "$page/book"
    cp -r "$target_dir/book" "$page/book"
    sed -i 's/ id="book" href="\([^"]*\)" hidden/ id="book" href="\1"/' "$page/index.html"
fi
# No browser reads its indentation either.
sed -E -i 's/^[ \t]+//' "$page/index.html"
echo "$page"
