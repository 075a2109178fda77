//! `control` and its protocol linked alone for the chips' instruction set, with a panic handler that cannot be linked.

use miette::{IntoDiagnostic, Result, WrapErr, miette};

use crate::project::Project;
use crate::toolchain::{Installed, RISCV};

/// What the panic handler calls; it exists nowhere.
const HANDLER: &str = "a_panic_is_reachable";

/// Links it, or with a planted panic sees that it does not link.
pub fn run(project: &Project, planted: bool) -> Result<()> {
    let toolchain = Installed::here()?.riscv()?;
    let mut command = toolchain.cargo("build");
    command.current_dir(project.root.join("tests/no-panic")).env("CARGO_TARGET_DIR", project.output("no-panic"));
    command.args(["--release", "--locked", "--bin", "on_target", "--target", RISCV]);
    command.args(["--features", if planted { "target,planted" } else { "target" }]);
    let output = command.output().into_diagnostic().wrap_err("cannot run cargo")?;
    let messages = String::from_utf8_lossy(&output.stderr);
    match (output.status.success(), planted) {
        (true, false) => println!("{RISCV}: no panic can be reached in `control` and its protocol"),
        (false, true) if messages.contains(HANDLER) => println!("{RISCV}: a planted panic is found"),
        (true, true) => return Err(miette!("the planted panic was linked: the check does not see panics")),
        (false, _) if messages.contains(HANDLER) => {
            return Err(miette!(
                help = "the linker's messages are above; indexing, unwrap, slices and arithmetic that can overflow are \
                        where panics come from",
                "{RISCV}: a panic can be reached in `control`:\n{messages}"
            ));
        }
        (false, _) => return Err(miette!("tests/no-panic does not build:\n{messages}")),
    }
    Ok(())
}
