use super::*;

fn noise(samples: usize) -> Vec<f64> {
    let mut state = 7_u64;
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..samples).map(|_| (0..12).map(|_| uniform()).sum()).collect()
}

/// Guards against a delay that is the recorder's: the low pass is found from the noise alone, and white noise has none.
#[test]
fn a_low_pass_is_seen_in_the_noise() {
    let tick_s = 1e-4;
    let white = noise(40_000);
    assert_eq!(LowPass::seen(&white, tick_s, 0.0, FROM[0], 0.0), []);
    let spectrum = Spectrum::new(40_000);
    // Noise like 1/f beside the white falls sooner, as if the corner were lower: out of the box of its prior, three times 5 %.
    for (order, corner_hz, pink, off) in [(4, 1800.0, 0.0, 0.06), (2, 1300.0, 0.1, 0.15)] {
        let truth = LowPass {
            order,
            corner_hz,
            is_circuit: false,
            is_supposed: false,
            is_shared: false,
        };
        let mut packed = spectrum.of(&white);
        for (line, own) in packed[1..].chunks_mut(2).enumerate() {
            let share = (line + 1) as f64 / 40_000.0;
            own.iter_mut().for_each(|own| *own *= (1.0_f64 + pink / share).sqrt());
        }
        let mut filtered = spectrum.back(&packed);
        truth.apply(&mut filtered, tick_s, &spectrum, &truth.responses(tick_s, 40_000), &[]);
        let (_, found) = LowPass::seen(&filtered, tick_s, 0.0, FROM[0], 0.0)[0];
        assert!(
            found.order.abs_diff(order) <= 1 && (found.corner_hz / corner_hz).ln().abs() < off,
            "{found:?}"
        );
    }
}

/// Guards the images: a filter of first order of straight lines, behind a lag or a delay, has a closed form.
#[test]
fn straight_lines_pass_as_they_are_solved() {
    let (tick_s, rows, corner_hz) = (1e-4, 2000, 1500.0);
    let own = LowPass {
        order: 1,
        corner_hz,
        is_circuit: true,
        is_supposed: false,
        is_shared: false,
    };
    let ticks = 1.0 / (2.0 * PI * corner_hz * tick_s);
    // y' = (u − y)/τ a share of a tick after u_k, over u_k + 1; u goes from u_k to u_{k + 1}, τ in ticks, `back` one tick back.
    let after = |share: f64, ticks: f64, back: Complex<f64>| {
        let at = |share: f64| {
            let decay = (-share / ticks).exp();
            (decay, share - (1.0 - decay) * ticks)
        };
        let (decay, rise) = at(1.0);
        let whole = (back * (1.0 - decay - rise) + rise) / (-back * decay + 1.0);
        let (decay, rise) = at(share);
        back * whole * decay + back * (1.0 - decay - rise) + rise
    };
    let behind = |lag: f64, delay: f64, back: Complex<f64>| {
        let field = if lag > 0.0 {
            after(1.0, lag, back)
        } else {
            back * delay + (1.0 - delay)
        };
        // 1/((1 + sτ)(1 + sl)) by its parts.
        let filtered = after(1.0 - delay, ticks, back) * ticks;
        let lagged = if lag > 0.0 {
            after(1.0, lag, back) * lag
        } else {
            Complex::default()
        };
        (field, (filtered - lagged) / (ticks - lag))
    };
    for (lag, delay) in [(0.0, 0.0), (0.3, 0.0), (0.0, 0.5), (0.0, 0.8)] {
        let before = Before {
            lag_s: lag * tick_s,
            delay_s: delay * tick_s,
            ..Before::default()
        };
        let images = own.images(&before, tick_s, rows);
        let plain = own.responses(tick_s, rows);
        for (line, (image, plain)) in images.into_iter().zip(plain).enumerate().skip(20).take(180) {
            let back = Complex::from_polar(1.0, -2.0 * PI * (line + 1) as f64 / rows as f64);
            let (field, solved) = behind(lag, delay, back);
            let (error, without) = ((plain * field + image - solved).norm(), (plain * field - solved).norm());
            assert!(
                error < 2e-3 && error < 0.1 * without,
                "{lag}, {delay}, {line}: {error} {without}"
            );
        }
    }
}

/// Guards what is summed at few places only: a fall like that of the images, to its last place.
#[test]
fn a_smooth_fall_is_known_between_its_nodes() {
    let fall = |share: f64| Complex::new(1.0, 2.0 * PI * (share - 4.0)).inv() / (share - 4.0).powi(2);
    let nodes: Vec<Complex<f64>> = (-1..=NODES + 2)
        .map(|node| fall(0.5 * f64::from(node) / f64::from(NODES)))
        .collect();
    for line in 1..=1000 {
        let share = 0.5 * f64::from(line) / 1000.0;
        let own = between(&nodes, 2.0 * share * f64::from(NODES));
        assert!((own / fall(share) - 1.0).norm() < 1e-8, "{share}: {own}");
    }
}

/// Guards the filter itself: below the corner its delay, at, below and above it |F|², and a line is only delayed.
#[test]
fn a_sine_passes_as_the_equation_says() {
    let (tick_s, rows) = (1e-4, 20_000);
    let spectrum = Spectrum::new(rows);
    for is_circuit in [false, true] {
        let own = LowPass {
            order: 3,
            corner_hz: 800.0,
            is_circuit,
            is_supposed: false,
            is_shared: false,
        };
        for frequency in [20.0, 200.0, 800.0, 1600.0] {
            let sine = |delay_s: f64| {
                let at = move |row: usize| 2.0 * PI * frequency * (row as f64 * tick_s - delay_s);
                (0..rows).map(move |row| at(row).sin())
            };
            let mut passed: Vec<f64> = sine(0.0).collect();
            own.apply(&mut passed, tick_s, &spectrum, &own.responses(tick_s, rows), &[]);
            let power = 2.0 * passed[10_000..].iter().map(|y| y * y).sum::<f64>() / 10_000.0;
            let expected = own.response(tick_s)(frequency * tick_s).norm_sqr();
            assert!((power / expected - 1.0).abs() < 1e-3, "{frequency}: {power}");
            if frequency < 100.0 {
                let delayed = sine(own.delay_s(tick_s)).zip(&passed).skip(100);
                assert!(delayed.take(19_000).all(|(one, other)| (one - other).abs() < 1e-4));
            }
            if is_circuit {
                assert!((expected - 1.0 / (1.0 + (frequency / 800.0).powi(6))).abs() < 1e-12);
            }
        }
        let mut line: Vec<f64> = (0..rows).map(|row| 2.5 + row as f64).collect();
        own.apply(&mut line, tick_s, &spectrum, &own.responses(tick_s, rows), &[]);
        let delayed = |row: usize| 2.5 + row as f64 - own.delay_s(tick_s) / tick_s;
        assert!((0..rows).all(|row| (line[row] - delayed(row)).abs() < 1e-6));
    }
}
