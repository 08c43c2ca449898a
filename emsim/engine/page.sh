#!/bin/sh
# Builds the engine of pages, src/page.rs as WebAssembly, and puts it where pages take it from. Before it, once:
#     rustup target add wasm32-unknown-unknown
set -e
cd "$(dirname "$0")/../.."
cargo build --manifest-path emsim/engine/Cargo.toml --no-default-features --target wasm32-unknown-unknown --profile web
python3 - "${CARGO_TARGET_DIR:-target}/wasm32-unknown-unknown/web/_engine.wasm" emsim/outputs/web/engine.lzma <<'END'
# as outputs/web/lzma.js reads it: with its length, for liblzma writes none into this format. Literals after code go best without
# places (pb=0).
import lzma, sys
with open(sys.argv[1], "rb") as file:
    data = file.read()
how = [{"id": lzma.FILTER_LZMA1, "preset": 9 | lzma.PRESET_EXTREME, "lc": 3, "lp": 0, "pb": 0}]
packed = lzma.compress(data, lzma.FORMAT_ALONE, filters=how)
with open(sys.argv[2], "wb") as file:
    file.write(packed[:5] + len(data).to_bytes(8, "little") + packed[13:])
END
