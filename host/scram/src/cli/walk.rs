//! What `scram sim` and `scram hil` do about the robot's body: whether it stands on the ground, and what is told of its walk.

use std::path::{Path, PathBuf};

use clap::Args;
use miette::{Report, miette};
use plot::{under_title, walk_plots};
use robot_file::Robot;
use simulation::{ClampedMetrics, Walk, WalkMetrics, track_csv};

use super::{Failure, table, write};

/// The pictures' data.
pub const TRACK: &str = "track.csv";

/// Where the robot stands, and what is shown of its walk.
#[derive(Args)]
pub struct Ground {
    /// The shaft alone on a bench, without the robot's body
    #[arg(long)]
    bench: bool,
    /// Backbones rolled by α, 2α, 3α, degrees, instead of the robot file's
    #[arg(long, value_name = "DEG", value_parser = alpha, allow_negative_numbers = true, conflicts_with = "bench")]
    alpha: Option<f64>,
    /// Also the robot walking in 3D: one HTML page that needs nothing else
    #[arg(long, value_name = "FILE", conflicts_with = "bench")]
    view: Option<PathBuf>,
}

/// What `--alpha` takes.
pub fn alpha(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (-360.0..=360.0).contains(&value) => Ok(value),
        _ => Err("α must be a number from -360 to 360 degrees".to_owned()),
    }
}

/// Rolls the backbones of a robot file by α, 2α, 3α.
///
/// # Errors
/// The file rolls each by itself.
pub fn roll(robot: &mut Robot, alpha_deg: Option<f64>) -> Result<(), Report> {
    let (Some(alpha_deg), Some(backbone)) = (alpha_deg, &mut robot.backbone) else { return Ok(()) };
    if backbone.roll_deg.is_some() {
        return Err(miette!(
            help = "take roll_deg out of the robot file",
            "backbone.roll_deg rolls every backbone by itself: --alpha would do nothing"
        ));
    }
    backbone.alpha_deg.value = alpha_deg;
    Ok(())
}

impl Ground {
    /// Whether the robot walks; its file with what the command line changes.
    ///
    /// # Errors
    /// The robot has no body to show or change, or the page could not be written.
    pub fn prepare(&self, robot: &mut Robot) -> Result<bool, Failure> {
        let asked = [(self.view.is_some(), "--view"), (self.alpha.is_some(), "--alpha")];
        if let (None, Some((_, flag))) = (&robot.body, asked.iter().find(|(given, _)| *given)) {
            let help = format!("leave {flag} out, or name a robot file with [body]");
            return Err(
                miette!(help = help, "robot `{}` has no body: {flag} is for a robot that walks", robot.name).into()
            );
        }
        roll(robot, self.alpha)?;
        if let Some(file) = &self.view {
            writable(file)?;
        }
        Ok(robot.body.is_some() && !self.bench)
    }

    /// Writes the files of a walk, if there is one.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, walk: Option<&Walk>, title: &str, out: &Path) -> Result<Vec<PathBuf>, Report> {
        let Some(walk) = walk else { return Ok(Vec::new()) };
        let mut files = vec![out.join(TRACK)];
        write(&files[0], &track_csv(&walk.track))?;
        for (name, svg) in walk_plots(&walk.track)? {
            let file = out.join(format!("{name}.svg"));
            write(&file, &under_title(title, &svg))?;
            files.push(file);
        }
        Ok(files)
    }

    /// Writes the page.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write_view(&self, walk: Option<&Walk>, title: &str) -> Result<Option<&Path>, Report> {
        let (Some(file), Some(walk)) = (&self.view, walk) else { return Ok(None) };
        let page = plot::view::page(&walk.track, title);
        write(file, &page)?;
        Ok(Some(file))
    }
}

/// Fails where a page would go under the name of something else, or over a file that is none.
fn is_page(file: &Path) -> Result<(), Report> {
    let ends = |ending: &str| file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(ending));
    if !ends("html") && !ends("htm") {
        return Err(miette!(
            help = "name a file that ends in .html",
            "--view {}: a page is written there, and the name is not a page's",
            file.display()
        ));
    }
    let mut beginning = Vec::new();
    // A pipe would wait, and a device has no beginning: they are written into, not over.
    if file.is_file()
        && let Ok(there) = std::fs::File::open(file)
    {
        let read = std::io::Read::read_to_end(&mut std::io::Read::take(there, 512), &mut beginning);
        let text = String::from_utf8_lossy(&beginning).to_lowercase();
        if read.is_ok() && !text.trim().is_empty() && !text.contains("<!doctype html") && !text.contains("<html") {
            return Err(miette!(
                help = "name another file, or remove this one",
                "--view {}: what is there is no page, and it is not written over",
                file.display()
            ));
        }
    }
    Ok(())
}

/// Fails before a run whose page would find no place.
fn writable(file: &Path) -> Result<(), Report> {
    let directory = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !directory.is_dir() {
        return Err(miette!(
            help = "make it first, or name a file in a directory that is there",
            "--view {}: there is no directory {}",
            file.display(),
            directory.display()
        ));
    }
    if file.is_dir() {
        return Err(miette!(help = "name a file in it", "--view {}: this is a directory", file.display()));
    }
    is_page(file)
}

/// Where a body is and how it stands, for the first line of the table.
pub fn place(walk: &Walk, robot: &Robot) -> String {
    match walk.track.plan.clamped {
        None => format!("on the ground, {}", backbones(robot)),
        Some(module) => format!("module {} clamped, {}", module + 1, backbones(robot)),
    }
}

/// How the backbones stand.
fn backbones(robot: &Robot) -> String {
    let Some(backbone) = &robot.backbone else { return String::new() };
    match &backbone.roll_deg {
        None => format!("α {}°", backbone.alpha_deg.value),
        Some(roll) => {
            let roll: Vec<String> = roll.iter().map(|deg| format!("{deg}°")).collect();
            format!("backbones at {}", roll.join(", "))
        }
    }
}

/// The walk's rows of the table.
pub fn facts(m: &WalkMetrics) -> Vec<(&'static str, String)> {
    let number = |value: Option<f64>, decimals| table::or_dash(value, decimals, "");
    let ahead = number(m.longitudinal_mm_per_s, 2);
    let left = number(m.lateral_mm_per_s, 2);
    let [low, high] = m.module_height_mm;
    vec![
        ("speed ahead / to the left, second half", format!("{ahead} / {left} mm/s")),
        ("turning to the left, second half", format!("{} °/s", number(m.yaw_deg_per_s, 2))),
        ("start to end: ahead / to the left / turned", {
            let [x, y] = m.displacement_mm.map(|mm| table::with_unit(mm, 1, ""));
            format!("{x} / {y} mm / {}", table::with_unit(m.turned_deg, 1, "°"))
        }),
        ("path of the centroid, with its shaking", table::with_unit(m.path_mm, 1, "mm")),
        ("height of the modules, tilt at most", format!("{low:.1} … {high:.1} mm, {:.1}°", m.tilt_deg)),
        ("feet on the ground, left/right, from the front", shares(&m.contact_share)),
        ("energy per distance, second half", table::or_dash(m.energy_per_distance_j_per_m, 0, "J/m")),
    ]
}

/// The rows of a robot that is held fast.
pub fn clamped_facts(m: &ClampedMetrics) -> Vec<(&'static str, String)> {
    let size = |[x, y, z]: &[f64; 3]| format!("{x:.2} × {y:.2} × {z:.2}");
    let modules = m.foot_path_mm.chunks(2).enumerate().filter(|(module, _)| module + 1 != m.clamped_module);
    let paths = modules.map(|(module, feet)| {
        let feet: Vec<String> = feet.iter().map(size).collect();
        format!("module {}: {} mm", module + 1, feet.join(", "))
    });
    vec![
        ("foot paths left, right: ahead × aside × up, second half", paths.collect::<Vec<_>>().join("\n")),
        ("tilt of a module at most", table::with_unit(m.tilt_deg, 1, "°")),
        ("feet on the ground, left/right, from the front", shares(&m.contact_share)),
    ]
}

/// "33/57, 86/86 %": left and right, module after module.
fn shares(of_feet: &[f64]) -> String {
    let percent = |share: &f64| format!("{:.0}", 100.0 * share);
    let modules = of_feet.chunks(2).map(|feet| feet.iter().map(percent).collect::<Vec<_>>().join("/"));
    format!("{} %", modules.collect::<Vec<_>>().join(", "))
}
