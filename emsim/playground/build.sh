#!/bin/sh
# Makes what the playground needs beside emsim's own Python files and puts it into emsim/playground/parts, from where
# `emsim playground` takes it: the engine as a module of Pyodide, Pyodide and the editor from npm. Before it, once:
#     rustup target add wasm32-unknown-emscripten
set -e
cd "$(dirname "$0")/../.."
parts=emsim/playground/parts
target=wasm32-unknown-emscripten
export PYO3_NO_PYTHON=1
cargo rustc --manifest-path emsim/engine/Cargo.toml --lib --crate-type staticlib --target $target --profile playground \
    --features extension-module
rm -rf $parts
mkdir -p $parts/pyodide $parts/licences
# What a module of Pyodide is at bottom: a shared library of WebAssembly. Its C functions, its unwinding and its Python are Pyodide's own,
# so that no Emscripten is needed here; the linker is Rust's.
lld="$(rustc --print sysroot)/lib/rustlib/$(rustc -vV | sed -n 's/^host: //p')/bin/rust-lld"
"$lld" -flavor wasm -shared --experimental-pic --import-memory --unresolved-symbols=import-dynamic --export=PyInit__engine \
    --gc-sections --strip-all "${CARGO_TARGET_DIR:-target}/$target/playground/lib_engine.a" -o $parts/_engine.so

cd emsim/playground
npm ci --ignore-scripts --no-audit --no-fund --loglevel=error
npm=node_modules
for file in pyodide.mjs pyodide.asm.mjs pyodide.asm.wasm python_stdlib.zip pyodide-lock.json; do
    cp $npm/pyodide/$file parts/pyodide/
done
# the platform's own program lies in a package beside it
$npm/.bin/esbuild editor.mjs --bundle --minify --format=iife --global-name=emsimEditor --legal-comments=none \
    --log-level=warning --outfile=parts/editor.js
for package in $npm/@codemirror/* $npm/@lezer/* $npm/@marijn/* $npm/crelt $npm/style-mod $npm/w3c-keyname; do
    cp $package/LICENSE "parts/licences/$(echo "${package#"$npm"/}" | tr / -)"
done
