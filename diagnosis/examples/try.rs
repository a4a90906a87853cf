use anhyst_diagnosis::*;
fn main() {
    let mut args = std::env::args().skip(1);
    let file = args.next().unwrap();
    let mut read = ReadOptions::default();
    let mut options = FitOptions::default();
    for a in args {
        let (k, v) = a.split_once(':').unwrap();
        match k {
            "drop" => read.drop_rows.push(v.parse().unwrap()),
            "fix" => options.fixed.push(v.parse().unwrap()),
            "sw" => options.strain_weight = v.parse().unwrap(),
            "starts" => options.starts = v.parse().unwrap(),
            "cand" => options.candidates = v.parse().unwrap(),
            "seed" => options.seed = v.parse().unwrap(),
            "begin" => {
                options.beginning = Some(match v {
                    "c" => Beginning::Cycled,
                    "m" => Beginning::Measured,
                    _ => Beginning::Fitted,
                })
            }
            "curve" => {
                options.curves = Curves::Only(if v == "L" {
                    anhyst_model::Anhysteretic::Langevin
                } else {
                    anhyst_model::Anhysteretic::Ising
                })
            }
            _ => panic!(),
        }
    }
    let data = MeasuredLoops::read(file.as_ref(), &read).unwrap_or_else(|e| panic!("{e}"));
    let t = std::time::Instant::now();
    let fit = fit(&data, &options, &mut |p| {
        eprintln!(
            "{:?} {} {}/{} {:.5}",
            t.elapsed(),
            p.stage,
            p.done,
            p.total,
            p.best_nrmse
        )
    })
    .unwrap();
    let r = &fit.report;
    println!(
        "{:?} {:?} M {:.3} % strain {:?}",
        t.elapsed(),
        r.anhysteretic,
        100.0 * r.magnetization_nrmse,
        r.strain_nrmse
    );
    for p in &r.parameters {
        println!("  {} = {:.5e} ± {:?}", p.symbol, p.value, p.standard_deviation);
    }
    println!(
        "  a_eff {:?} gamma {:?} cond {:.1}",
        r.effective_shape_a_per_m, r.strain, r.condition_number
    );
    for l in &r.loops {
        println!(
            "  loop {} {:?} {:.3} % off {:.0} tau {:.1} pooled {} {:?}",
            l.id,
            l.beginning,
            100.0 * l.magnetization_nrmse,
            l.magnetization_offset_a_per_m,
            l.correlation_length_samples,
            l.pooled_samples,
            l.strain
        );
    }
    for c in &r.correlation {
        println!("  {:.4?}", c);
    }
    println!("  {:?}", r.search);
    for w in &r.warnings {
        println!("  ! {w}");
    }
    std::fs::write("/tmp/fit.svg", picture(&fit).unwrap()).unwrap();
    if let Ok(t) = material_text(&fit, "Terfenol-D, measured at 7.1 MPa") {
        std::fs::write("/tmp/terfenol_d_measured.ron", t).unwrap();
    }
}
