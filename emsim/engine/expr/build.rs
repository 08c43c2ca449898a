//! Tells the code whether Cranelift is there.
use std::env;

fn main() {
    // Cranelift stands for our own encoder where that has no code, see Cargo.toml
    println!("cargo:rustc-check-cfg=cfg(cranelift)");
    let target = |key: &str| env::var(format!("CARGO_CFG_{key}")).unwrap_or_default();
    let own = target("TARGET_ARCH") == "x86_64" && target("TARGET_FAMILY").contains("unix");
    let wasm = target("TARGET_FAMILY").contains("wasm"); // its code is fixed when it is loaded: expressions are interpreted
    if !(own || wasm) || env::var_os("CARGO_FEATURE_CRANELIFT").is_some() {
        println!("cargo:rustc-cfg=cranelift");
    }
}
