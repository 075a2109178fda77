//! Where outputs go: links, devices and pipes are what they were, and a full disk takes nothing away.
#![cfg(unix)]

use std::fs;
use std::io::Read;
use std::os::unix::fs::{FileTypeExt, symlink};
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::common;
use crate::common::command::{command, json, refuses, succeeds, temporary};

const EXPORT: &str = "export mjcf --robot @/robot.toml";
const TURNING: &str = "sim --robot @/robot.toml --bench --drive duty:1 --seconds 2.5";
const IDENTIFY: &str = "identify potentiometer turning/run.mcap --robot @/robot.toml";
/// Few runs, for it to be quick.
const DIAGNOSE: &str = "diagnose @/examples/hidden-effect/run-1.csv @/examples/hidden-effect/run-2.csv --robot \
    @/examples/hidden-effect/robot.toml";
const SIM: &str = "sim --robot @/robot.toml --seconds 0.3";

/// Runs words in a shell: `script` has the command as `"$@"`.
fn shell(directory: &Path, script: &str, words: &str) -> Output {
    let inner = command(directory, words);
    let mut shell = Command::new("bash");
    shell.args(["-c", script, "bash"]).arg(inner.get_program()).args(inner.get_args()).current_dir(directory);
    shell.output().unwrap()
}

/// A directory's files with what is in them, links as they are.
fn files(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let entries = fs::read_dir(directory).unwrap().map(|entry| entry.unwrap());
    let files = entries.filter(|entry| entry.path().is_file());
    let mut files: Vec<_> =
        files.map(|e| (e.file_name().into_string().unwrap(), fs::read(e.path()).unwrap())).collect();
    files.sort();
    files
}

#[test]
fn a_link_stays_and_its_target_is_replaced() {
    let directory = temporary();
    let at = |name: &str| directory.path().join(name);
    fs::create_dir_all(at("far")).unwrap();
    fs::create_dir_all(at("out")).unwrap();
    for name in ["run.csv", "run.mcap", "path.svg"] {
        fs::write(at("far").join(name), "before").unwrap();
        symlink(Path::new("../far").join(name), at("out").join(name)).unwrap();
    }
    symlink("far/page.html", at("page.html")).unwrap();
    symlink("far/robot.xml", at("robot.xml")).unwrap();
    succeeds(directory.path(), &format!("{SIM} --view page.html --out out --overwrite"));
    succeeds(directory.path(), &format!("{EXPORT} -o robot.xml"));
    for name in ["run.csv", "run.mcap", "path.svg"] {
        assert!(at("out").join(name).is_symlink(), "{name}");
    }
    assert!(at("page.html").is_symlink() && at("robot.xml").is_symlink());
    let names: Vec<String> = files(&at("far")).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["page.html", "path.svg", "robot.xml", "run.csv", "run.mcap"], "and no temporary file");
    assert!(files(&at("far")).iter().all(|(_, bytes)| bytes.len() > 1000), "all are new");
    assert_eq!(fs::read_to_string(at("far/robot.xml")).unwrap(), succeeds(directory.path(), EXPORT));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_is_said_and_stays() {
    let directory = temporary();
    // By way of a link: what is written to by mistake is the link.
    let link = directory.path().join("full.html");
    symlink("/dev/full", &link).unwrap();
    for words in [format!("{EXPORT} -o full.html"), format!("{SIM} --view full.html")] {
        refuses(directory.path(), &words, 1, &["full.html: the disk is full"]);
        assert!(link.is_symlink());
        assert!(fs::metadata("/dev/full").unwrap().file_type().is_char_device());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn standard_output_is_written_on_whatever_it_is() {
    let directory = temporary();
    let model = succeeds(directory.path(), EXPORT);
    let words = format!("{EXPORT} -o /dev/stdout");
    assert_eq!(succeeds(directory.path(), &words), model, "a pipe");
    let output = shell(directory.path(), "{ echo before; \"$@\"; echo after; } > all", &words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(fs::read_to_string(directory.path().join("all")).unwrap(), format!("before\n{model}after\n"), "a file");
}

#[test]
fn a_file_that_does_not_fit_is_named_and_takes_nothing_away() {
    let directory = temporary();
    succeeds(directory.path(), &format!("{SIM} --view page.html --out out"));
    succeeds(directory.path(), &format!("{EXPORT} -o robot.xml"));
    let before = (files(directory.path()), files(&directory.path().join("out")));
    // A limit on the size of files: ignored, its signal is an error of the write.
    let full = "trap '' XFSZ; ulimit -f 4; exec \"$@\"";
    let says = [
        (format!("{EXPORT} -o robot.xml"), "robot.xml"),
        (format!("{SIM} --seed 2 --out out --overwrite"), "out/run.mcap"),
        (format!("{SIM} --out new"), "new/run.mcap"),
        (format!("{SIM} --bench --out new"), "new/run.mcap"),
        (SIM.to_owned(), "out/run-0001/run.mcap"),
    ];
    for (words, named) in says {
        let output = shell(directory.path(), full, &words);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{words}: {message}");
        let named = format!("{named}: the file is larger than it may be here: nothing of it is kept");
        assert!(message.contains(&named) && message.contains("ulimit -f"), "{words}: {message}");
        assert!(!message.contains("check the name"), "{words}: {message}");
    }
    assert_eq!(files(directory.path()), before.0);
    assert!(files(&directory.path().join("out")) == before.1, "nothing is lost, and no temporary file is left");
    assert!(files(&directory.path().join("new")).is_empty());
    for name in ["run-0001", "latest"] {
        assert!(!directory.path().join("out").join(name).is_symlink(), "{name}");
        assert!(!directory.path().join("out").join(name).exists(), "{name} leads to a run that is not there");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_recording_that_does_not_fit_says_that_the_disk_is_full() {
    let directory = temporary();
    let tiny = directory.path().join("tiny");
    fs::create_dir(&tiny).unwrap();
    // Full at the beginning of the first file, in its midst, and at a later file.
    for (size, file) in [("4k", "run.mcap"), ("64k", "run.mcap"), ("360k", ".svg")] {
        let script = "\"$@\"; code=$?; ls \"$TINY\"; exit $code";
        let Some(mut command) = common::command::on_a_disk_of(&tiny, size, script) else {
            testbed::peers::skip_anywhere("this user may not mount a file system of his own");
            return;
        };
        command.arg(assert_cmd::cargo::cargo_bin!("scram")).args(["sim", "--bench", "--seconds", "0.3", "--robot"]);
        let output = command.arg(common::robot_file()).arg("--out").arg(&tiny).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{size}: {message}");
        for part in [&format!("{file}: the disk is full: nothing of it is kept"), "make room on the disk"] {
            assert!(message.contains(part), "{size}: `{message}` does not say `{part}`");
        }
        assert!(!message.contains("permissions"), "{size}: {message}");
        let left = String::from_utf8_lossy(&output.stdout);
        assert_eq!(left.is_empty(), file == "run.mcap", "{size}: no more than the files before it is left: {left}");
        assert!(!left.contains(".part"), "{size}: {left}");
    }
}

/// Of one pipe for stdout and stderr: how much is read before nobody reads any more.
const READ: [usize; 2] = [0, 1];

/// Runs a command with stdout and stderr in one pipe that is closed after some bytes: the exit code, and what was read.
fn cut_off(mut command: Command, bytes: usize) -> (Option<i32>, String) {
    let (mut reader, writer) = std::io::pipe().unwrap();
    command.stdin(Stdio::null()).stdout(writer.try_clone().unwrap()).stderr(writer);
    if bytes == 0 {
        drop(reader);
        return (command.status().unwrap().code(), String::new());
    }
    let mut child = command.spawn().unwrap();
    // It holds two ends of the pipe.
    drop(command);
    let mut read = vec![0; bytes];
    reader.read_exact(&mut read).unwrap();
    drop(reader);
    (child.wait().unwrap().code(), String::from_utf8_lossy(&read).into_owned())
}

/// [`READ`] bytes of both, and stdout alone closed with every word on stderr read.
#[track_caller]
fn ends_quietly(words: &str, command: impl Fn(&str) -> Command) {
    for bytes in READ {
        let (code, read) = cut_off(command(words), bytes);
        assert_eq!(code, Some(0), "{words}, after {bytes} bytes: {read}");
    }
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = command(words).stdout(writer).stderr(Stdio::piped()).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{words}: {message}");
    assert!(!message.contains("panicked") && !message.contains("roken pipe"), "{words}: {message}");
}

#[test]
fn a_reader_that_goes_away_ends_nothing_with_a_panic() {
    let directory = temporary();
    succeeds(directory.path(), &format!("{TURNING} --out turning"));
    for words in [
        "--help",
        "sim --help",
        "completions bash",
        "design --robot @/robot.toml",
        EXPORT,
        &format!("{SIM} --json"),
        SIM,
        "sweep --robot @/robot.toml --drive ideal --repeats 1 --seconds 0.2 --axis backbone.segments=3 --axis f=-8,8",
        &format!("{IDENTIFY} --json"),
        IDENTIFY,
        "replay turning/run.mcap --robot @/robot.toml",
        "console --sim --json --command list --robot @/robot.toml",
    ] {
        ends_quietly(words, |words| command(directory.path(), words));
    }
    // Seconds each: the pipe is closed at one place of each of the two.
    for words in [DIAGNOSE, &format!("{DIAGNOSE} --json")] {
        let (code, read) = cut_off(command(directory.path(), words), 1);
        assert_eq!(code, Some(0), "{words}: {read}");
    }
    // What was refused says so to nobody, and its exit code still says it.
    for bytes in READ {
        assert_eq!(cut_off(command(directory.path(), "sim --robot missing.toml"), bytes).0, Some(1));
        assert_eq!(cut_off(command(directory.path(), "sim --no-such-word"), bytes).0, Some(2));
    }
}

/// Cargo says what it builds on the same pipe.
#[test]
fn a_reader_that_goes_away_does_not_end_the_build_for_qemu() {
    if common::pil::program().is_none() {
        return;
    }
    let directory = temporary();
    let out = directory.path().join("out");
    // The program is built in the project's root. Though nothing is left to build, a line a crate is said about it.
    ends_quietly(&format!("hil --qemu --bench --seconds 0.2 --overwrite --out {}", out.display()), |words| {
        let mut command = command(&common::root(), words);
        command.env("CARGO_TERM_VERBOSE", "true");
        command
    });
    assert!(out.join("run.mcap").is_file());
}

/// Pictures are passed on without what was beside them.
#[test]
fn every_picture_says_what_it_shows() {
    let directory = temporary();
    let titled = |folder: &str, title: &str| {
        let (mut pictures, folder) = (0, directory.path().join(folder));
        for (name, bytes) in files(&folder).into_iter().filter(|(name, _)| name.ends_with(".svg")) {
            let text = String::from_utf8(bytes).unwrap();
            let document = roxmltree::Document::parse(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
            let mut titles = document.root_element().children().filter(|node| node.has_tag_name("title"));
            assert_eq!(titles.next().and_then(|node| node.text()), Some(title), "{name}");
            pictures += 1;
        }
        assert!(pictures > 0, "{}", folder.display());
    };
    succeeds(directory.path(), &format!("{SIM} --set motor.resistance_ohm=16 --faults stall@0.2 --seed 4 --out walk"));
    titled("walk", "scram-26, freq:7 for 0.3 s, seed 4, motor.resistance_ohm=16, stall@0.2, on the ground, α 60°");
    succeeds(directory.path(), &format!("{TURNING} --out turning"));
    titled("turning", "scram-26, duty:1 for 2.5 s, seed 1, the motor alone");
    succeeds(directory.path(), &format!("{IDENTIFY} --out found"));
    titled("found", "scram-26, turning/run.mcap");
    succeeds(directory.path(), "replay walk/run.csv --robot @/robots/motor-136.toml --out again");
    titled("again", "walk/run.csv: scram-26, freq:7, seed 4");
    succeeds(directory.path(), "replay walk/run.mcap --robot @/robot.toml --out compared");
    let comparison = fs::read_to_string(directory.path().join("compared/replay-comparison.svg")).unwrap();
    assert!(comparison.contains("walk/run.mcap: scram-26, freq:7, seed 4; decided again with "), "{comparison}");
    let sweep = "sweep --robot @/robot.toml --drive ideal --repeats 2 --seconds 0.2 --axis f=-8,8 --out sweep";
    succeeds(directory.path(), sweep);
    titled("sweep", "scram-26, ideal shaft, 2 runs of 0.2 s each, seeds 1 … 2");
}

#[test]
fn what_was_found_in_a_recording_is_written_over_only_on_request() {
    let directory = temporary();
    let at = |name: &str| directory.path().join(name);
    succeeds(directory.path(), TURNING);
    let recorded = files(&at("out/run-0001"));
    let replay = "replay out/latest/run.mcap --robot @/robot.toml";
    let identify = IDENTIFY.replace("turning", "out/latest");
    for (words, series, name) in [
        (replay, "replay", "replay.svg"),
        (&identify, "identify", "potentiometer.svg"),
        (DIAGNOSE, "diagnose", "report.html"),
    ] {
        for number in ["0001", "0002"] {
            succeeds(directory.path(), words);
            let link = at("out").join(format!("latest-{series}"));
            assert_eq!(fs::read_link(link).unwrap(), Path::new(&format!("{series}-{number}")));
            assert!(at("out").join(format!("{series}-{number}")).join(name).is_file());
        }
        let own = format!("{words} --out own-{series}");
        succeeds(directory.path(), &own);
        let own_directory = at(&format!("own-{series}"));
        // Somebody's own from here on: the size alone would not tell.
        for (name, _) in files(&own_directory) {
            fs::write(own_directory.join(name), "mine").unwrap();
        }
        for (name, _) in files(&own_directory) {
            let kept = temporary();
            fs::write(kept.path().join(&name), "mine").unwrap();
            let into = format!("{words} --out {}", kept.path().display());
            refuses(directory.path(), &into, 1, &[&name, "is there already", "--overwrite"]);
            assert_eq!(files(kept.path()), [(name, b"mine".to_vec())]);
        }
        succeeds(directory.path(), &format!("{own} --overwrite"));
        assert!(files(&own_directory).iter().all(|(_, bytes)| bytes != b"mine"), "{series}");
    }
    assert_eq!(fs::read_link(at("out/latest")).unwrap(), Path::new("run-0001"), "it leads to the recording still");
    assert!(files(&at("out/run-0001")) == recorded, "the recording is as it was");
    let found = json(&succeeds(directory.path(), &format!("{identify} --json")));
    assert_eq!(found["files"][0], "out/identify-0003/robot.toml");
}
