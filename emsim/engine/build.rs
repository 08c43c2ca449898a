//! Copies the Lark grammars into `OUT_DIR/grammar`, from where maturin ships them in the wheel as `emsim/grammar`.
use std::{env, fs, path::Path};

fn main() {
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
