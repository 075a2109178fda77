//! `control` and its protocol, linked alone, contain no panic: the panic handler calls a function that exists nowhere,
//! so a reachable panic is a link error. The planted panic shows that the check can fail. This is the host's machine
//! code; `cargo pil` does the same for the chips'.

use std::path::Path;
use std::process::{Command, Output};

fn link_control_alone(extra: &[&str]) -> Output {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("no-panic/Cargo.toml");
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).join("no-panic");
    Command::new(env!("CARGO"))
        .args(["rustc", "--release", "--locked", "--lib", "--crate-type", "cdylib", "--manifest-path"])
        .arg(manifest)
        .arg("--target-dir")
        .arg(target)
        .args(extra)
        // A shared library may leave symbols open; this one may not.
        .args(["--", "-C", "link-arg=-Wl,-z,defs"])
        .env_remove("RUSTFLAGS")
        .output()
        .expect("cargo starts")
}

#[test]
fn control_has_no_reachable_panic() {
    let output = link_control_alone(&[]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn a_planted_panic_is_found() {
    let output = link_control_alone(&["--features", "planted"]);
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success(), "the planted panic was linked");
    assert!(messages.contains("a_panic_is_reachable"), "failed for another reason:\n{messages}");
}
