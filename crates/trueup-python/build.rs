//! What linking an extension module needs where undefined symbols are an error.

fn main() {
    // Python itself has the functions that are called; only macOS has to be told that this is meant.
    if std::env::var("CARGO_CFG_TARGET_OS").is_ok_and(|system| system == "macos") {
        println!("cargo::rustc-cdylib-link-arg=-undefined");
        println!("cargo::rustc-cdylib-link-arg=dynamic_lookup");
    }
    println!("cargo::rerun-if-changed=build.rs");
}
