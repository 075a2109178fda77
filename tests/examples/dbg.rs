use system_tests::own::{examine, sets};
fn main() {
    for i in std::env::args().skip(1) {
        let i: usize = i.parse().unwrap();
        let out = examine(sets(i, 1, false)[i - 1]);
        println!("{}", out.line());
        let Ok(said) = &out.said else { continue };
        println!("left {:?}", said.left_over);
        for p in &said.detail.nominal {
            println!("  {} {:.4e} [{:.3e} {:.3e}] file {:?}", p.path, p.value, p.low, p.high, p.file_value);
        }
        let mut errs: Vec<(usize, f64)> =
            said.detail.rollout_errors.iter().map(|e| e.before / said.noise_floor).enumerate().collect();
        errs.sort_by(|a, b| b.1.total_cmp(&a.1));
        println!(
            "errors: worst {:?} median {:.2} p90 {:.2}",
            &errs[..6].iter().map(|e| (e.0, (e.1 * 100.0).round() / 100.0)).collect::<Vec<_>>(),
            errs[errs.len() / 2].1,
            errs[errs.len() / 10].1
        );
        for u in &said.detail.runs {
            println!("  {u:?}");
        }
        for t in said.detail.traces.iter().take(2) {
            println!("trace {} {}", t.run, t.why);
            for (k, s) in t.samples.iter().enumerate().take(400) {
                if k % 8 == 0 || s.starts {
                    println!(
                        "   {:.4} {} {:?} {:.4}",
                        s.t_s,
                        s.starts,
                        s.measured.map(|m| (m * 1e4).round() / 1e4),
                        s.before
                    );
                }
            }
        }
    }
}
