//! What the overlaps say of the response, and how much it does to them.

use rayon::prelude::*;
use trueup_core::Result;
use trueup_core::color::TransferCurve;

use super::equations::LightEquations;
use super::overlap::Observed;
use super::predicted::Predicted;
use super::robust::mean;
use super::samples::Shared;
use super::solution::{Differences, Solution};
use crate::light::RESPONSE_TERMS;

/// Straight lines through the response's functions against the logarithm of light.
#[derive(Default)]
struct Line {
    count: f64,
    light: f64,
    squares: f64,
    terms: [f64; RESPONSE_TERMS],
    products: [f64; RESPONSE_TERMS],
}

impl Line {
    fn add(&mut self, light: f64, terms: [f64; RESPONSE_TERMS]) {
        self.count += 1.0;
        self.light += light;
        self.squares += light * light;
        for (term, value) in terms.into_iter().enumerate() {
            self.terms[term] += value;
            self.products[term] += light * value;
        }
    }

    /// The lines through the points of both.
    fn merged(self, other: &Self) -> Self {
        let sums = |a: [f64; RESPONSE_TERMS], b: [f64; RESPONSE_TERMS]| std::array::from_fn(|term| a[term] + b[term]);
        Self {
            count: self.count + other.count,
            light: self.light + other.light,
            squares: self.squares + other.squares,
            terms: sums(self.terms, other.terms),
            products: sums(self.products, other.products),
        }
    }

    /// The slopes of the lines; 0 where all light is the same.
    fn slopes(&self) -> [f64; RESPONSE_TERMS] {
        let spread = self.squares - self.light * self.light / self.count;
        std::array::from_fn(|term| {
            let common = self.products[term] - self.light * self.terms[term] / self.count;
            if spread > 0.0 { common / spread } else { 0.0 }
        })
    }
}

impl LightEquations<'_> {
    /// By how much the functions of the response differ in every sample, by what the solution says the photographs
    /// show.
    pub(super) fn predict(&self, solution: &mut Solution, profile: &TransferCurve) -> Result<()> {
        let predicted = Predicted::new(profile, &solution.response)?;
        let of = |one: &Observed| -> (Vec<Differences>, Line) {
            let mut line = Line::default();
            let samples = one.samples.iter().map(|sample| {
                std::array::from_fn(|channel| {
                    let factor = |photograph, r2| self.log_factor(solution, photograph, channel, r2);
                    let factors = [factor(one.pair.first, sample.radius[0]), factor(one.pair.second, sample.radius[1])];
                    let light = sample.log_light.map(|light| f64::from(light[channel]));
                    let terms = predicted.terms(light, factors, sample.variances);
                    light.into_iter().zip(terms).for_each(|(light, terms)| line.add(light, terms));
                    std::array::from_fn(|term| (terms[0][term] - terms[1][term]) as f32)
                })
            });
            (samples.collect(), line)
        };
        let (answers, lines): (_, Vec<Line>) = self.observed.par_iter().map(of).unzip();
        solution.answers = answers;
        solution.slopes = lines.iter().fold(Line::default(), Line::merged).slopes();
        Ok(())
    }

    /// What the response does to the ratios of photographs: the root of the mean square of what it adds to their
    /// logarithms, but for what is the same all over an overlap, which gains do as well.
    pub(super) fn effect(&self, weights: &[Vec<f64>], solution: &Solution) -> f64 {
        let (mut squares, mut total) = (0.0, 0.0);
        for (index, (one, weights)) in self.observed.iter().zip(weights).enumerate() {
            let share = self.share(one);
            let added = |(sample, ratio): (&Shared, [f64; 3])| mean(ratio) - f64::from(sample.brightness());
            let weighed = || solution.ratios(index, one).map(added).zip(weights);
            let sum: f64 = weights.iter().sum();
            let common = weighed().map(|(added, weight)| weight * added).sum::<f64>() / sum.max(f64::MIN_POSITIVE);
            squares += share * weighed().map(|(added, weight)| weight * (added - common).powi(2)).sum::<f64>();
            total += share * sum;
        }
        if total > 0.0 { (squares / total).sqrt() } else { 0.0 }
    }
}
