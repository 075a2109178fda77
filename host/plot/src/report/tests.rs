//! The page holds the numbers, stands alone, and cannot be broken by a name.

use super::*;
use diagnose::{
    Cause, Detail, Gain, LeftOver, MisfitBin, MisfitCurve, RolloutError, RolloutTrace, TermKind, TermPoint, TraceSample,
};

const FLOOR: f64 = 2.1e-3;

/// Deterministic noise of unit variance.
fn noise(state: &mut u64) -> f64 {
    (0..12)
        .map(|_| {
            *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (*state >> 11) as f64 / (1u64 << 53) as f64
        })
        .sum::<f64>()
        - 6.0
}

fn parameter(path: &str, value: f64, spread: f64, file_value: Option<f64>) -> FittedParameter {
    FittedParameter { path: path.into(), value, low: value - spread, high: value + spread, file_value }
}

fn candidate(effects: &[&str], ratio: f64, before: f64, named: bool) -> CandidateEvidence {
    let removed = 100.0 * (1.0 - ratio / before);
    CandidateEvidence {
        effects: effects.iter().map(|&name| name.to_owned()).collect(),
        held_out_rmse: ratio * FLOOR,
        ratio_to_floor: ratio,
        improvement_percent: [removed, removed - 2.0, removed + 2.0],
        parameters: Vec::new(),
        speaks_for: if removed > 5.0 {
            vec![format!("removes {removed:.0} % of the held-out error")]
        } else {
            Vec::new()
        },
        speaks_against: if named { Vec::new() } else { vec![format!("leaves {ratio:.2} times the noise floor")] },
        named,
    }
}

fn misfit_curve(coordinate: &str, (from, to): (f64, f64), before: f64, after: f64) -> MisfitCurve {
    let bins = (0..24)
        .filter(|bin| *bin != 11)
        .map(|bin| {
            let width = (to - from) / 24.0;
            let place = f64::from(bin) / 23.0;
            let bump = 0.6 + 0.8 * (-((place - 0.55) / 0.2).powi(2)).exp();
            MisfitBin {
                from: from + width * f64::from(bin),
                to: from + width * f64::from(bin + 1),
                samples: 400,
                before: FLOOR * before * bump,
                after: FLOOR * after * (0.95 + 0.1 * place),
                bias_before: 0.0,
                bias_after: 0.0,
            }
        })
        .collect();
    MisfitCurve { coordinate: coordinate.into(), bins }
}

fn trace(why: &str, before: f64, after: f64, seed: u64) -> RolloutTrace {
    let mut state = seed;
    let samples = (0..500)
        .map(|i| {
            let t = 0.001 * f64::from(i);
            let within = f64::from(i % 100) / 100.0;
            let truth = 44.0 * t + 0.6 * (9.0 * t).sin();
            let measured = truth + FLOOR * noise(&mut state);
            TraceSample {
                t_s: 3.0 + t,
                starts: i % 100 == 0,
                measured: ((truth.rem_euclid(std::f64::consts::TAU)) > 0.9).then_some(measured),
                before: truth + FLOOR * (before - 1.0) * (3.0 * within * within - 0.7),
                after: truth + FLOOR * (after - 1.0) * (2.0 * within - 0.8),
            }
        })
        .collect();
    RolloutTrace { run: "noise_step_06".into(), why: why.into(), samples }
}

/// A diagnosis as the numbers of a real one are.
fn missing_term() -> MissingTerm {
    let point = |i: u32| {
        let at = 0.1 * f64::from(i) - 4.0;
        let value = 2e-4 * at.sin();
        TermPoint { at, value, low: value - 2e-5, high: value + 2e-5 }
    };
    let points = (0..81).map(point).collect();
    MissingTerm { coordinate: "angle_rad".into(), kind: TermKind::TorqueNm, promised: 0.71, chance: 3e-4, points }
}

pub(crate) fn sample(verdict: Verdict) -> Diagnosis {
    let (before, after) = match verdict {
        Verdict::Nothing => (1.01, 1.01),
        Verdict::Explained => (4.4, 1.01),
        Verdict::Ambiguous => (2.3, 1.02),
        Verdict::Unexplained => (5.2, 2.6),
    };
    let cause = |effect: &str, also: &[&str]| Cause {
        effect: effect.into(),
        also: also.iter().map(|&name| name.to_owned()).collect(),
        parameters: [("torque_nm".to_owned(), [4.4e-4, 4.1e-4, 4.7e-4])].into(),
    };
    let causes = match verdict {
        Verdict::Nothing => Vec::new(),
        Verdict::Explained => vec![cause("stribeck_friction", &[])],
        Verdict::Ambiguous => vec![cause("coulomb_friction", &["load_friction"])],
        Verdict::Unexplained => vec![cause("gravity_tilt", &[])],
    };
    let named: Vec<String> = causes.iter().map(|cause| cause.effect.clone()).collect();
    let models = causes
        .iter()
        .flat_map(|cause| std::iter::once(&cause.effect).chain(&cause.also))
        .map(|name| vec![name.clone()])
        .collect();
    let mut candidates = vec![candidate(&[], before, before, false)];
    let others = [
        "stribeck_friction",
        "coulomb_friction",
        "load_friction",
        "driver_drop",
        "gravity_tilt",
        "battery_sag",
        "sensor_delay",
        "sensor_nonlinearity",
    ];
    for (i, other) in others.iter().enumerate() {
        let is_named = named.iter().any(|name| name == other);
        let ratio = if is_named { after } else { (after + 0.35 * (i as f64 + 1.0)).min(before) };
        candidates.push(candidate(&[other], ratio, before, is_named));
    }
    if verdict == Verdict::Unexplained {
        for other in &others[..6] {
            candidates.push(candidate(&[other, "sensor_delay"], after + 0.1, before, false));
        }
    }
    candidates[1..].sort_by(|a, b| a.ratio_to_floor.total_cmp(&b.ratio_to_floor));
    let mut state = 7;
    let rollout_errors = (0..160)
        .map(|_| {
            let spread = (0.25 * noise(&mut state)).exp();
            RolloutError { before: FLOOR * before * spread, after: FLOOR * after * (0.08 * noise(&mut state)).exp() }
        })
        .collect();
    let gained = 100.0 * (1.0 - (after * after - 1.0) / (before * before - 1.0));
    let run = |name: &str, held_out| RunUse {
        name: name.into(),
        held_out,
        seconds: 8.0,
        samples: 8000,
        used: 6534,
        missing: 1440,
        blind: 310,
        pull_unknown: if held_out { 427 } else { 0 },
        spikes: 26,
        rollouts: 80,
    };
    let mut extended = vec![
        parameter("motor.resistance_ohm", 16.21, 0.14, Some(15.0)),
        parameter("motor.torque_constant_nm_per_a", 0.02012, 1.1e-4, Some(0.0209)),
        parameter("motor.rotor_inertia_kg_m2", 1.42e-6, 3e-8, Some(1.2e-6)),
    ];
    for name in &named {
        extended.push(parameter(&format!("effects.{name}.torque_nm"), 4.4e-4, 3e-5, None));
    }
    Diagnosis {
        verdict,
        causes,
        models,
        limits: vec![
            Limit {
                effect: "driver_deadband".into(),
                at_most: [("width_duty".to_owned(), Some(0.0031))].into(),
                chance: 0.4,
                would_show: true,
            },
            Limit {
                effect: "battery_sag".into(),
                at_most: [("resistance_ohm".to_owned(), None)].into(),
                chance: 1.0,
                would_show: false,
            },
        ],
        noise_floor: FLOOR,
        before: before * FLOOR,
        after: after * FLOOR,
        after_cross_judged: after * FLOOR,
        gain: if named.is_empty() {
            Gain::default()
        } else {
            Gain { percent_of_excess_removed: gained, low: gained - 3.1, high: (gained + 2.2).min(100.0) }
        },
        left_over: (verdict == Verdict::Unexplained).then(|| LeftOver {
            coordinate: "angle_rad".into(),
            from: 0.4,
            to: 1.2,
            share: 0.64,
            runs: Vec::new(),
        }),
        rig_doubts: Vec::new(),
        missing_terms: if verdict == Verdict::Nothing { Vec::new() } else { vec![missing_term()] },
        scale_free: [
            ("motor.inertia_v_s2_per_rad".to_owned(), [1.144e-3, 1.141e-3, 1.147e-3]),
            ("stribeck_friction.torque_v".to_owned(), [0.354, 0.341, 0.367]),
        ]
        .into(),
        next_experiment: match verdict {
            Verdict::Ambiguous => Some("accelerate hard and coast freely through the same speeds: only load friction differs between the two".into()),
            Verdict::Unexplained => Some("turn slowly at several constant speeds, both ways: what depends on the angle repeats every turn".into()),
            _ => None,
        },
        detail: Detail {
            horizon_s: 0.1,
            held_out_rollouts: 160,
            fit_runs: vec!["a".into()],
            held_out_runs: vec!["noise_step_05".into(), "noise_step_06".into()],
            nominal: extended[..3].to_vec(),
            extended,
            rivals: Vec::new(),
            candidates,
            misfit_map: vec![
                misfit_curve("angle_rad", (-3.1, 3.1), before, after),
                misfit_curve("speed_rad_per_s", (-70.0, 70.0), before, after),
                misfit_curve("voltage_v", (-5.0, 5.0), before, after),
                misfit_curve("time_s", (0.0, 8.0), before, after),
                misfit_curve("time_in_rollout_s", (0.0, 0.1), before, after),
            ],
            traces: vec![
                trace("worst before", 1.7 * before, after, 1),
                trace("typical", before, after, 2),
                trace("worst after", before, 1.1 * after, 3),
            ],
            rollout_errors,
            runs: vec![run("steps_01", false), run("sweep_02", false), run("chirp_03", false), run("noise_04", false), run("noise_step_05", true), run("noise_step_06", true)],
            is_of_open_numbers: false,
            summary: vec!["Simulated freely for 0.10 s at a time, the model with refitted numbers is off by 0.529° on runs it has not seen; the angle reading itself scatters by 0.120°.".into()],
        },
    }
}

fn about() -> About {
    About {
        robot: "scram-26".into(),
        robot_file: "robot.toml".into(),
        extended_file: Some("out/robot-extended.toml".into()),
        tracking: vec![Comparison {
            drive: "freq:7".into(),
            rows: vec![
                ComparedFigure { what: "phase, RMS", unit: "deg", before: Some(12.3), after: Some(2.1) },
                ComparedFigure { what: "speed settled after", unit: "s", before: None, after: Some(0.4) },
            ],
            stopped: [Some("stall".into()), None],
        }],
    }
}

const ALL: [Verdict; 4] = [Verdict::Nothing, Verdict::Explained, Verdict::Ambiguous, Verdict::Unexplained];

fn parse(page: &str) -> roxmltree::Document<'_> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..roxmltree::ParsingOptions::default() };
    roxmltree::Document::parse_with_options(page, options).unwrap_or_else(|error| panic!("not well-formed: {error}"))
}

#[test]
fn every_verdict_is_one_well_formed_file_with_its_numbers() {
    for verdict in ALL {
        let diagnosis = sample(verdict);
        let page = html(&diagnosis, &about());
        if let Ok(folder) = std::env::var("SCRAM_REPORT_SAMPLES") {
            std::fs::write(format!("{folder}/{}.html", verdict.word()), &page).unwrap();
        }
        let document = parse(&page);
        let text: String = document.descendants().filter_map(|node| node.text()).collect::<Vec<_>>().join(" ");
        let mut wanted = vec![degrees(diagnosis.noise_floor), degrees(diagnosis.before), degrees(diagnosis.after)];
        wanted.push(words::headline(&diagnosis).replace(" %", "\u{a0}%"));
        wanted.extend(diagnosis.next_experiment.clone());
        wanted.extend(["motor.inertia_v_s2_per_rad", "0.341 … 0.367"].map(str::to_owned));
        wanted.extend((!diagnosis.missing_terms.is_empty()).then(|| "torque, mN·m".to_owned()));
        if !diagnosis.causes.is_empty() {
            wanted.push(format!("{} %", percent(diagnosis.gain.percent_of_excess_removed)));
            wanted.push(format!("{} to {} %", percent(diagnosis.gain.low), percent(diagnosis.gain.high)));
        }
        for want in wanted {
            assert!(text.contains(&want), "{verdict:?}: {want:?} is not in the page");
        }
        assert_eq!(
            document.descendants().filter(|node| node.has_tag_name(("http://www.w3.org/2000/svg", "svg"))).count(),
            12 + diagnosis.missing_terms.len()
        );
    }
}

/// Titles of the charts, and how many lines of a class are in them.
fn titles_and_lines(page: &str) -> (Vec<String>, [usize; 2]) {
    let document = parse(page);
    let of = |class: &'static str| document.descendants().filter(move |node| node.attribute("class") == Some(class));
    let titles = of("title").filter_map(|node| node.text().map(str::to_owned)).collect();
    (titles, ["before", "after"].map(|class| of(class).filter(|node| node.has_tag_name(SVG_PATH)).count()))
}

const SVG_PATH: (&str, &str) = ("http://www.w3.org/2000/svg", "path");

#[test]
fn where_nothing_was_added_there_is_one_model_with_one_curve() {
    let mut diagnosis = sample(Verdict::Unexplained);
    diagnosis.causes.clear();
    diagnosis.after = diagnosis.before;
    let traces = &mut diagnosis.detail.traces;
    traces.iter_mut().flat_map(|trace| &mut trace.samples).for_each(|sample| sample.after = sample.before);
    traces[2].samples = traces[0].samples.clone();
    let page = html(&diagnosis, &about());
    let (titles, [before, after]) = titles_and_lines(&page);
    assert!(before > 0 && after == 0, "{before} and {after} lines");
    assert!(titles.contains(&"worst (noise_step_06)".to_owned()), "{titles:?}");
    assert!(!titles.iter().any(|title| title.contains("after")), "{titles:?}");
    assert!(page.contains("the refitted model") && !page.contains("extended model (after)"));

    // With a cause there are two, and a stretch that is worst twice is drawn once.
    let mut diagnosis = sample(Verdict::Explained);
    diagnosis.detail.traces[2].samples = diagnosis.detail.traces[0].samples.clone();
    let (titles, [before, after]) = titles_and_lines(&html(&diagnosis, &about()));
    assert_eq!(before, after + diagnosis.missing_terms.len(), "a missing term is drawn as a line before");
    assert!(titles.contains(&"worst before and worst after (noise_step_06)".to_owned()), "{titles:?}");
}

#[test]
fn one_value_makes_no_curve_and_is_said() {
    let mut diagnosis = sample(Verdict::Unexplained);
    let (titles, _) = titles_and_lines(&html(&diagnosis, &about()));
    assert!(titles.contains(&"against commanded voltage".to_owned()));
    diagnosis.detail.misfit_map[2].bins.truncate(1);
    let run = misfit_curve("run", (0.5, 1.5), 1.0, 1.0);
    diagnosis.detail.misfit_map.push(MisfitCurve { bins: run.bins[..1].to_vec(), ..run });
    let page = html(&diagnosis, &about());
    let (titles, _) = titles_and_lines(&page);
    assert!(!titles.contains(&"against commanded voltage".to_owned()), "{titles:?}");
    assert!(page.contains("without a curve: commanded voltage and run."), "nothing says why");
}

#[test]
fn what_was_left_out_of_a_walk_is_said_and_only_there() {
    let mut diagnosis = sample(Verdict::Nothing);
    let counted = |diagnosis: &Diagnosis| {
        let page = html(diagnosis, &about());
        let start = page.find("<h2>Data used").unwrap();
        let table = &page[start..start + page[start..].find("</table>").unwrap()];
        let rows = diagnosis.detail.runs.len();
        assert_eq!(table.matches("<td").count(), rows * table.matches("<th class").count() + 2 * rows);
        (table.contains("the body's pull is unknown"), table.contains(">427<"))
    };
    assert_eq!(counted(&diagnosis), (true, true));
    diagnosis.detail.runs.iter_mut().for_each(|run| run.pull_unknown = 0);
    assert_eq!(counted(&diagnosis), (false, false));
}

#[test]
fn nothing_is_loaded_from_outside() {
    for verdict in ALL {
        let page = html(&sample(verdict), &about());
        let document = parse(&page);
        for node in document.descendants().filter(roxmltree::Node::is_element) {
            assert!(!matches!(node.tag_name().name(), "script" | "link" | "iframe" | "img"), "{:?}", node.tag_name());
            for attribute in node.attributes() {
                assert!(!attribute.value().contains("://"), "{} = {}", attribute.name(), attribute.value());
                assert!(!matches!(attribute.name(), "src" | "href"), "{}", attribute.name());
            }
        }
        assert!(!page.contains("@import") && !page.contains("url(http"));
    }
}

#[test]
fn names_cannot_break_the_page() {
    let mut diagnosis = sample(Verdict::Unexplained);
    let evil = "</style><script>alert('x')</script>&\"\u{1}";
    diagnosis.detail.runs[0].name = evil.into();
    diagnosis.detail.traces[0].run = evil.into();
    diagnosis.detail.summary.push(evil.into());
    diagnosis.detail.candidates[1].effects[0] = evil.into();
    diagnosis.detail.candidates[1].speaks_for.push(evil.into());
    diagnosis.detail.misfit_map[0].coordinate = evil.into();
    diagnosis.detail.extended[0].path = evil.into();
    diagnosis.causes[0].effect = evil.into();
    diagnosis.next_experiment = Some(evil.into());
    if let Some(left) = &mut diagnosis.left_over {
        left.coordinate = evil.into();
    }
    let page = html(
        &diagnosis,
        &About { robot: evil.into(), robot_file: evil.into(), extended_file: Some(evil.into()), ..about() },
    );
    let document = parse(&page);
    assert!(!document.descendants().any(|node| node.tag_name().name() == "script"));
}

#[test]
fn a_diagnosis_without_detail_and_with_wild_numbers_still_renders() {
    let mut bare = sample(Verdict::Unexplained);
    bare.detail = Detail::default();
    parse(&html(&bare, &About::default()));

    let mut wild = sample(Verdict::Explained);
    wild.noise_floor = 0.0;
    wild.after = f64::NAN;
    wild.gain.low = f64::NEG_INFINITY;
    wild.detail.rollout_errors[0].before = f64::INFINITY;
    wild.detail.rollout_errors[1].after = f64::NAN;
    wild.detail.misfit_map[0].bins[3].before = f64::NAN;
    wild.detail.traces[0].samples[4].before = f64::INFINITY;
    let page = html(&wild, &about());
    parse(&page);
    assert!(!page.contains("NaN") && !page.contains("inf\""), "a number that is none reached the page");
}

#[test]
fn headlines_say_it_in_words() {
    let headline = words::headline(&sample(Verdict::Explained));
    assert!(headline.starts_with("Stribeck friction explains 99.8 %"), "{headline}");
    let headline = words::headline(&sample(Verdict::Ambiguous));
    assert!(headline.contains("Coulomb friction or load friction") && headline.contains("cannot tell"), "{headline}");
}

#[test]
fn a_number_that_no_fit_moves_has_no_interval() {
    let row = |spread: f64| parameter_row(&parameter("effects.driver_drop.slope_ohm", 0.0, spread, None));
    assert!(row(0.0).contains("assumed") && !row(0.0).contains(" … "), "{}", row(0.0));
    assert!(row(1.0).contains(" … ") && !row(1.0).contains("assumed"), "{}", row(1.0));
}
