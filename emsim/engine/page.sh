#!/bin/sh
# Builds the engine of pages, src/page.rs as WebAssembly, and puts it where pages take it from. Before it, once:
#     rustup target add wasm32-unknown-unknown
set -e
cd "$(dirname "$0")/../.."
cargo build --manifest-path emsim/engine/Cargo.toml --no-default-features --target wasm32-unknown-unknown --profile web
cp "${CARGO_TARGET_DIR:-target}/wasm32-unknown-unknown/web/_engine.wasm" emsim/outputs/web/engine.wasm
