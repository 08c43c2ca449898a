//! Tells the code whether Cranelift is there, and copies the Lark grammars into `OUT_DIR/grammar`, from where maturin ships them in the wheel as `emsim/grammar`.
use std::{env, fs, path::Path};

fn main() {
    // Cranelift stands for our own encoder where that has no code, see Cargo.toml
    println!("cargo:rustc-check-cfg=cfg(cranelift)");
    let target = |key: &str| env::var(format!("CARGO_CFG_{key}")).unwrap_or_default();
    let own = target("TARGET_ARCH") == "x86_64" && target("TARGET_FAMILY").contains("unix");
    if !own || env::var_os("CARGO_FEATURE_CRANELIFT").is_some() {
        println!("cargo:rustc-cfg=cranelift");
    }

    let source = Path::new("../../grammar");
    let target = Path::new(&env::var("OUT_DIR").unwrap()).join("grammar");
    fs::create_dir_all(&target).expect("cannot create OUT_DIR/grammar");
    println!("cargo:rerun-if-changed={}", source.display());
    if let Ok(entries) = fs::read_dir(source) {
        for entry in entries.flatten() {
            let path = entry.path();
            if path.extension().is_some_and(|e| e == "lark") {
                println!("cargo:rerun-if-changed={}", path.display());
                fs::copy(&path, target.join(path.file_name().unwrap())).expect("cannot copy a grammar");
            }
        }
    }
}
