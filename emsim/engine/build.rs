//! Copies the Lark grammars and the lessons into `OUT_DIR`, from where maturin ships them in the
//! wheel as `emsim/grammar` and `emsim/lessons`.
use std::{env, fs, path::Path};

fn main() {
    copy("../../grammar", "grammar", &["lark"]);
    copy("../../netlists/lessons", "lessons", &["cir", "md"]);
}

fn copy(source: &str, name: &str, kinds: &[&str]) {
    let target = Path::new(&env::var("OUT_DIR").unwrap()).join(name);
    fs::create_dir_all(&target).expect("cannot create a folder in OUT_DIR");
    println!("cargo:rerun-if-changed={source}");
    if let Ok(entries) = fs::read_dir(source) {
        for path in entries.flatten().map(|entry| entry.path()) {
            if path.extension().is_some_and(|e| kinds.iter().any(|kind| e == *kind)) {
                println!("cargo:rerun-if-changed={}", path.display());
                fs::copy(&path, target.join(path.file_name().unwrap())).expect("cannot copy a file into OUT_DIR");
            }
        }
    }
}
