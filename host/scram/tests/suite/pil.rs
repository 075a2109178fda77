//! The processor in the loop: RISC-V machine code in QEMU makes the recording that the host's own controller makes.
//! Skipped, and said so, where QEMU or a toolchain for RISC-V is missing; with SCRAM_ALL_PEERS=1 that is a failure.

use std::path::Path;
use std::process::Command;

use crate::common::pil::program;
use crate::common::root;
use robot_file::gait::GaitFile;
use scram::hil::{PROGRAM, Qemu};
use testbed::peers::skip;

const SCRAM: &str = env!("CARGO_BIN_EXE_scram");

/// Runs a subcommand with a drive; what it printed on stdout.
fn scram(arguments: &[&str], drive: &str, out: &Path) -> serde_json::Value {
    let mut command = Command::new(SCRAM);
    command.current_dir(root()).args(arguments).args(["--drive", drive, "--seconds", "2", "--json", "--out"]).arg(out);
    let output = command.output().expect("scram starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Runs a drive here and in QEMU, compares every byte of the recordings, and gives what was printed.
fn same(elf: &Path, drive: &str) -> (serde_json::Value, serde_json::Value) {
    let elf = elf.to_str().expect("a path in UTF-8");
    let out = tempfile::tempdir().expect("a folder");
    let (ours, theirs) = (out.path().join("sim"), out.path().join("hil"));
    let sim = scram(&["sim"], drive, &ours);
    let hil = scram(&["hil", "--qemu", "--elf", elf], drive, &theirs);
    for name in ["run.mcap", "run.csv", "run.toml"] {
        let read = |folder: &Path| std::fs::read(folder.join(name)).expect(name);
        assert!(read(&ours) == read(&theirs), "{name} differs");
    }
    (sim, hil)
}

#[test]
fn qemu_makes_the_recording_of_sim() {
    let Some(elf) = program() else { return };
    let (sim, hil) = same(&elf, "freq:7");
    assert_eq!(sim["mean_frequency_hz"], hil["mean_frequency_hz"]);
    let mean = hil["mean_frequency_hz"].as_f64().expect("a frequency");
    assert!((mean / 7.0 - 1.0).abs() < 5e-3, "{mean} Hz");
    let chip = &hil["chip"];
    assert!(chip["cost_worst"].as_u64() > Some(1000) && chip["stack_bytes"].as_u64() > Some(100), "{chip}");
    assert_eq!((&chip["bad_frames_here"], &chip["bad_frames_there"]), (&0.into(), &0.into()), "{chip}");
}

#[test]
fn qemu_plays_a_gait_as_sim_does() {
    let Some(elf) = program() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("turn.toml");
    // It ends within the two seconds.
    let steps: Vec<f64> = (0..40).map(|step| if step / 5 % 2 == 0 { 7.5 } else { -6.0 }).collect();
    GaitFile::new("turn", 0.04, false, &steps).and_then(|gait| gait.save(&file)).expect("a file");
    let (sim, hil) = same(&elf, &format!("gait:{}", file.display()));
    assert!(sim["energy_j"].as_f64() > Some(0.1), "{sim}");
    assert_eq!(sim["energy_j"], hil["energy_j"]);
}

#[test]
fn what_is_no_program_ends_with_a_reason() {
    if Qemu::is_installed().is_err() {
        skip(&format!("there is no {PROGRAM}"));
        return;
    }
    let run = |elf: &str| {
        let output = Command::new(SCRAM).current_dir(root()).args(["hil", "--qemu", "--elf", elf]).output();
        let output = output.expect("scram starts");
        assert_eq!(output.status.code(), Some(1));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let said = run("no/such/program");
    assert!(said.contains("there is no program no/such/program") && said.contains("build-pil"), "{said}");
    let said = run("robot.toml");
    assert!(said.contains("nobody answers") || said.contains("ended"), "{said}");
}
