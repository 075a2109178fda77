//! Nothing: without it the build dependencies would not count.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
}
