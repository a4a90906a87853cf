//! Fits of a composition: derivatives, damped steps, and what they leave uncertain.
//!
//! J (`likelihood.rs`) is minimised by Gauss-Newton steps with Marquardt's damping: H = AᵀS⁻¹A + 1/σ², S the band's level, reweighted
//! within each step; a step counts only if J itself falls. A is a forward difference of free simulations, carried on by Broyden's rule (1965).
//! What constants imitate lies in a long valley, which is bent: where a step fails, a second one with the same A comes back into it, as far as the first has
//! gone; and no fit that leaves only noise ends before a step with next to no damping has gained nothing.

use std::borrow::Cow;
use std::sync::Arc;

use anhyst_identify::parallel;
use anhyst_model::EffectKind;
use nalgebra::DMatrix;

use crate::composition::Composition;
use crate::evidence::Evidence;
use crate::likelihood::{Bench, Point};
use crate::normal::Normal;
use crate::plant::Steps;
use crate::products::Products;
use crate::unknown::{Slot, Unknown};

/// Next to no damping.
const LEAST_DAMPING: f64 = 1e-9;
/// Dampings that are tried for one step.
const MAX_DAMPINGS: usize = 6;
const MAX_STEPS: usize = 20;
/// A step that lowers J by less is the last one.
const WORTH: f64 = 0.05;
/// Of a rough fit.
const ROUGH_STEPS: usize = 12;
/// A rough fit that leaves a misfit ends when J falls by less than this share of its fall so far.
const VAIN: f64 = 3e-3;
/// Derivatives are good enough as long as J has fallen by less than this since they were taken.
const SETTLED: f64 = 1.0;
/// Rounds of levels and multiples in one step.
const ROUNDS: usize = 4;
/// A coordinate by ratio moves by at most this a step.
const MAX_LOG_STEP: f64 = 1.0;

/// A fitted composition.
#[derive(Clone)]
pub(crate) struct Fitted {
    pub point: Point,
    /// Derivative of the spectra by each unknown's free coordinate.
    pub columns: Vec<Arc<Vec<f64>>>,
}

/// Broyden's rule: the least change of the derivatives, each in its own unit, under which the step would have been foreseen.
fn carry(columns: &mut [Arc<Vec<f64>>], before: &Point, here: &Point, normal: &Normal) {
    let unknowns = before.composition.unknowns.iter().zip(&here.composition.unknowns);
    let steps: Vec<f64> = unknowns
        .map(|(old, new)| new.coordinate.free(new.value) - old.coordinate.free(old.value))
        .collect();
    let mut unforeseen: Vec<f64> = here
        .simulated
        .iter()
        .zip(&before.simulated)
        .map(|(new, old)| new - old)
        .collect();
    for (column, step) in columns.iter().zip(&steps).filter(|(_, step)| **step != 0.0) {
        for (own, slope) in unforeseen.iter_mut().zip(column.iter()) {
            *own -= slope * step;
        }
    }
    let scaled: Vec<f64> = (0..steps.len())
        .map(|index| normal.matrix[(index, index)] * steps[index])
        .collect();
    let size: f64 = scaled.iter().zip(&steps).map(|(own, step)| own * step).sum();
    for (column, own) in columns.iter_mut().zip(&scaled).filter(|(_, own)| **own != 0.0) {
        let share = own / size;
        for (slope, unforeseen) in Arc::make_mut(column).iter_mut().zip(&unforeseen) {
            *slope += share * unforeseen;
        }
    }
}

impl Fitted {
    /// What is left, derivatives and linear nuisance.
    pub fn all(&self) -> Vec<&[f64]> {
        self.point.with(&self.columns)
    }

    /// The same with the derivatives of a part of each channel's rows, the first ones, to begin a fit of it from.
    pub fn first_part(&self, whole: &Bench, part: &Bench) -> Self {
        let cut = |column: &Arc<Vec<f64>>| {
            let channels = whole.plant.channels.iter().zip(&part.plant.channels);
            let spectra = channels.flat_map(|(all, own)| {
                let series = all.spectrum.back(&column[all.places.clone()]);
                let mut spectrum = own.spectrum.of(&series[..own.rows.len()]);
                spectrum[0] = 0.0;
                spectrum
            });
            Arc::new(spectra.collect::<Vec<f64>>())
        };
        Fitted {
            point: self.point.clone(),
            columns: self.columns.iter().map(cut).collect(),
        }
    }
}

impl Bench {
    /// Derivatives by the free coordinates; those of `known` are taken from there.
    pub fn columns(&self, here: &Point, known: Option<&Fitted>) -> Option<Vec<Arc<Vec<f64>>>> {
        let unknowns = &here.composition.unknowns;
        let indices: Vec<usize> = (0..unknowns.len()).collect();
        let smooth = if self.plant.has_steps(&here.composition) {
            Cow::Owned(self.simulate(&here.composition, Steps::LeftOut)?.1)
        } else {
            Cow::Borrowed(&here.simulated)
        };
        let columns = parallel::map(self.threads, &indices, |&index| {
            let unknown = &unknowns[index];
            let own = known.and_then(|fit| {
                let of = fit
                    .point
                    .composition
                    .unknowns
                    .iter()
                    .position(|own| own.slot == unknown.slot)?;
                let same = fit.point.composition.unknowns[of].coordinate.scale == unknown.coordinate.scale;
                same.then(|| fit.columns[of].clone())
            });
            own.or_else(|| self.column(here, &smooth, index).map(Arc::new))
        });
        columns.into_iter().collect()
    }

    fn column(&self, here: &Point, smooth: &[f64], index: usize) -> Option<Vec<f64>> {
        let Unknown {
            value,
            coordinate,
            slot,
        } = here.composition.unknowns[index];
        if coordinate.lower >= coordinate.upper {
            return Some(vec![0.0; here.simulated.len()]);
        }
        let free = coordinate.free(value);
        let difference = |step: f64| {
            let mut moved = here.composition.clone();
            moved.unknowns[index].value = coordinate.value(free + step);
            let inverse = 1.0 / (coordinate.free(moved.unknowns[index].value) - free);
            let mut column = self.change_from(smooth, &moved, Steps::LeftOut)?;
            column.iter_mut().for_each(|own| *own *= inverse);
            inverse.is_finite().then_some(column)
        };
        let step = match slot {
            // Frequencies aside, ratios answer smoothly to a hundredth.
            Slot::Corner(_) => 0.01,
            Slot::Effect(
                EffectKind::AfterEffect
                | EffectKind::Friction
                | EffectKind::AmplifierSaturation
                | EffectKind::SensorSaturation,
                place,
            ) if place > 0 => 0.05,
            // It bites sample by sample.
            Slot::Effect(kind, place) if kind.parameters()[place].is_limit() => 0.01,
            _ => coordinate.step(value),
        };
        // Near the edge of what the model allows, only a small step of one sign may be left.
        let shares = [1.0, -1.0, 0.1, -0.1, 0.01, -0.01];
        shares.into_iter().find_map(|share| difference(share * step))
    }

    /// A composition as it is, with its derivatives.
    pub fn unfitted(&self, composition: &Composition) -> Option<Fitted> {
        let point = self.point(composition)?;
        let columns = self.columns(&point, None)?;
        Some(Fitted { point, columns })
    }

    /// Fits the unknowns of a composition from their values; `known` lends its derivatives of all that it has in common, which a rough
    /// fit keeps. Derivatives are carried from step to step by what each step has shown of them, and taken anew where it stalls.
    pub fn fit(&self, composition: &Composition, known: Option<&Fitted>) -> Option<Fitted> {
        let mut here = self.point(composition)?;
        let mut columns = self.columns(&here, known)?;
        let mut damping = 1e-3;
        // Gained since the derivatives were taken; none where they are of here.
        let mut carried: Option<f64> = None;
        // The last step was one with next to no damping: where an effect is what constants imitate, any other is too short to be worth it.
        let mut is_bold = false;
        let (from, evidence) = (here.cost, Evidence::new(self, &here));
        // What a step shows of the derivatives is the converter's.
        let has_steps = self.plant.has_steps(composition);
        let steps = if known.is_some() { ROUGH_STEPS } else { MAX_STEPS };
        for _ in 0..steps {
            let products = Products::of(&self.bands, &here.with(&columns));
            let mut next = None;
            let dampings = if carried.is_some() { 1 } else { MAX_DAMPINGS };
            for attempt in 0..dampings {
                let falls = |tried: &Point| tried.cost < here.cost;
                let tried = self.point(&self.stepped(&here, &products, damping));
                next = tried.and_then(|tried| match falls(&tried) {
                    false if attempt == 0 && known.is_none() => self.back_in_the_valley(&tried, &columns, damping),
                    _ => Some(tried),
                });
                next = next.filter(falls);
                if next.is_some() {
                    damping = (damping * 0.1).max(LEAST_DAMPING);
                    break;
                }
                // It was the derivatives that failed where they were carried here.
                if carried.is_none() {
                    damping *= 10.0;
                }
            }
            let gained = next.as_ref().map_or(0.0, |next| here.cost - next.cost);
            let before = next.map(|next| std::mem::replace(&mut here, next));
            // What leaves a misfit however it is fitted is not worth the last of it.
            let least = if known.is_some() {
                SETTLED.max(VAIN * (from - here.cost))
            } else {
                SETTLED
            };
            let is_vain = || gained < least && evidence.is_misfit_at(&here.levels);
            if carried.is_none_or(|carried| carried < SETTLED) && (gained < WORTH || is_vain()) {
                // A misfit's valleys lead nowhere.
                if is_bold || known.is_some() || evidence.is_misfit_at(&here.levels) {
                    break;
                }
                (is_bold, damping) = (true, LEAST_DAMPING);
                continue;
            }
            is_bold = false;
            let is_stuck = before.is_none();
            match before.filter(|_| known.is_none() && gained > SETTLED && !has_steps) {
                Some(before) => {
                    carry(
                        &mut columns,
                        &before,
                        &here,
                        &products.normal(&self.weights(&before.levels)),
                    );
                    carried = Some(carried.unwrap_or(0.0) + gained);
                }
                None => {
                    columns = self.columns(&here, known)?;
                    carried = None;
                    if is_stuck {
                        damping = damping.min(1e-3);
                    }
                }
            }
        }
        Some(Fitted { point: here, columns })
    }

    /// The point after another step with the same derivatives: of what imitates each other the valley is bent, and a straight step along it
    /// leaves it.
    fn back_in_the_valley(&self, tried: &Point, columns: &[Arc<Vec<f64>>], damping: f64) -> Option<Point> {
        let products = Products::of(&self.bands, &tried.with(columns));
        self.point(&self.stepped(tried, &products, damping))
    }

    /// The composition after a damped step: the multiples of all columns under which J of their sum is least, in rounds in which levels
    /// and multiples settle on each other.
    fn stepped(&self, here: &Point, products: &Products, damping: f64) -> Composition {
        let unknowns = &here.composition.unknowns;
        let mut weights = self.weights(&here.levels);
        let mut moved = here.composition.clone();
        for _ in 0..ROUNDS {
            let mut normal = products.normal(&weights);
            let pull = normal.believe(unknowns);
            let mut held = vec![false; pull.len()];
            let mut step = normal.damped(&pull, damping, unknowns.len(), &held);
            // What stands at a bound and would leave: without it, again.
            while let Some(index) =
                (0..unknowns.len()).find(|index| !held[*index] && unknowns[*index].leaves(step[*index]))
            {
                held[index] = true;
                step = normal.damped(&pull, damping, unknowns.len(), &held);
            }
            moved.unknowns.clone_from(unknowns);
            let all = moved.unknowns.iter_mut().zip(unknowns).zip(&mut step);
            // What is held keeps its bits.
            for ((own, before), step) in all.filter(|(_, step)| **step != 0.0) {
                let coordinate = &own.coordinate;
                if coordinate.logarithmic {
                    *step = step.clamp(-MAX_LOG_STEP, MAX_LOG_STEP);
                }
                let free = coordinate.free(before.value);
                own.value = coordinate.value(free + *step);
                *step = coordinate.free(own.value) - free;
            }
            weights = self.weights(&self.levels(&products.left(&step)));
        }
        moved
    }

    /// Covariance of the free coordinates under some levels, the linear nuisance let free: H⁻¹ by noise and misfit, and K Kᵀ with
    /// K = H⁻¹AᵀS⁻¹B by what nothing was fitted for, B the answer to a standard deviation of each ([`Plant::doubts`]).
    pub fn covariance(&self, fit: &Fitted, levels: &[f64]) -> DMatrix<f64> {
        let (inverse, moved) = self.inverse_and_moved(fit, levels, true);
        let size = fit.columns.len();
        (inverse + &moved * moved.transpose())
            .view((0, 0), (size, size))
            .into_owned()
    }

    /// Standard deviations of the free coordinates by what is not known of the drive alone.
    pub fn doubt(&self, fit: &Fitted) -> Vec<f64> {
        let (_, moved) = self.inverse_and_moved(fit, &fit.point.levels, false);
        moved.row_iter().take(fit.columns.len()).map(|own| own.norm()).collect()
    }

    /// H⁻¹ and K.
    fn inverse_and_moved(&self, fit: &Fitted, levels: &[f64], with_tick: bool) -> (DMatrix<f64>, DMatrix<f64>) {
        let doubts = self
            .plant
            .doubts(&fit.point.composition, &fit.point.simulated, with_tick);
        let mut all = fit.all();
        let own = all.len() - 1;
        all.extend(doubts.iter().map(Vec::as_slice));
        let normal = Products::of(&self.bands, &all).normal(&self.weights(levels));
        let across = normal.matrix.view((0, own), (own, doubts.len()));
        let mut inner = Normal {
            matrix: normal.matrix.view((0, 0), (own, own)).into_owned(),
            right: normal.right.rows(0, own).into_owned(),
        };
        inner.believe(&fit.point.composition.unknowns);
        let inverse = inner.inverse();
        let moved = &inverse * across;
        (inverse, moved)
    }
}
