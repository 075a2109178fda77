//! A shared library may leave symbols open; this one may not.
fn main() {
    println!("cargo::rustc-cdylib-link-arg=-Wl,-z,defs");
    println!("cargo::rerun-if-changed=build.rs");
}
