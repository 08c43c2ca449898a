//! Tells the code whether Cranelift is there, which stands for our own encoder where that has no code (Cargo.toml).
fn main() {
    println!("cargo:rustc-check-cfg=cfg(cranelift)");
    let target = |key: &str| std::env::var(format!("CARGO_CFG_{key}")).unwrap_or_default();
    let own = target("TARGET_ARCH") == "x86_64" && target("TARGET_FAMILY").contains("unix");
    let wasm = target("TARGET_FAMILY").contains("wasm"); // its code is fixed when it is loaded: expressions are interpreted
    if !(own || wasm) || std::env::var_os("CARGO_FEATURE_CRANELIFT").is_some() {
        println!("cargo:rustc-cfg=cranelift");
    }
}
