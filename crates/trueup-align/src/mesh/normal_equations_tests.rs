//! Assembled equations against the energy itself, evaluated and differentiated numerically.

use proptest::prelude::*;

use super::*;

/// Sums over near and far vertices of one grid and another, one vertex twice.
fn sums() -> Vec<(Vec<WeightedVertex>, Metric, Vector2<f64>)> {
    let of = |photograph, vertex, weight| WeightedVertex { photograph, vertex, weight };
    let along = Metric::along(Vector2::new(0.6, 0.8), 3.0);
    vec![
        (vec![of(0, 0, 1.0), of(0, 1, -0.5), of(0, 41, -0.5)], Metric::isotropic(2.0), Vector2::new(1.0, 2.0)),
        (vec![of(0, 5, 0.7), of(1, 3, -0.4), of(1, 40, 0.3), of(0, 5, 0.2)], along, Vector2::new(-3.0, 1.0)),
        (vec![of(1, 9, 1.0)], Metric { xx: 2.0, xy: 0.5, yy: 1.0 }, Vector2::new(0.0, 4.0)),
    ]
}

/// A vertex carried from the later grid into the earlier one, and the other way round.
fn carried() -> [CarriedVertex<'static>; 2] {
    let members = &[(3, 0.4), (4, 0.6)];
    let (factor, value) = (Vector2::new(0.8, -0.5), Vector2::new(1.0, -2.0));
    let one = CarriedVertex { from: [0, 7], to: 1, members, factor, value, squared_weight: 2.0 };
    [one, CarriedVertex { from: [1, 8], to: 0, ..one }]
}

fn carried_energy(at: &[f64], vertices: usize) -> f64 {
    let vertex = |grid: usize, vertex: usize| {
        let first = 2 * (grid * vertices + vertex);
        Vector2::new(at[first], at[first + 1])
    };
    carried()
        .iter()
        .map(|one| {
            let sum = one.members.iter().fold(Vector2::zeros(), |sum, &(m, weight)| sum + vertex(one.to, m) * weight);
            let turned = nalgebra::Complex::new(one.factor.x, one.factor.y) * nalgebra::Complex::new(sum.x, sum.y);
            let residual = vertex(one.from[0], one.from[1]) - Vector2::new(turned.re, turned.im) - one.value;
            one.squared_weight * residual.norm_squared()
        })
        .sum()
}

fn energy(at: &[f64]) -> f64 {
    let vertices = at.len() / 4;
    let sum_of = |members: &[WeightedVertex]| {
        members.iter().fold(Vector2::zeros(), |sum, one| {
            let vertex = one.photograph * vertices + one.vertex;
            sum + Vector2::new(at[2 * vertex], at[2 * vertex + 1]) * one.weight
        })
    };
    sums()
        .iter()
        .map(|(members, metric, value)| {
            let residual: Vector2<f64> = sum_of(members) - value;
            residual.dot(&metric.apply(residual))
        })
        .sum::<f64>()
        + carried_energy(at, vertices)
}

proptest! {
    /// Half the energy's gradient is A^T A x - A^T b.
    #[test]
    fn the_gradient_is_that_of_the_energy(seed in proptest::collection::vec(-5.0..5.0_f64, 24)) {
        let grids = vec![GridMesh::regular(80.0, 60.0, 10.0); 2];
        let mut equations = NormalEquations::new(&grids);
        for (members, metric, value) in sums() {
            equations.add_sum(&members, metric, value);
        }
        carried().iter().for_each(|one| equations.add_carried(one));
        // Every vertex needs a block of its own.
        for photograph in 0..2 {
            for vertex in 0..grids[0].len() {
                equations.add_inside(photograph, &[(vertex, Vector2::zeros())], Vector2::zeros());
            }
        }
        let unknowns = equations.unknowns();
        let at: Vec<f64> = (0..unknowns).map(|k| seed[k % seed.len()] + 0.1 * k as f64).collect();
        let mut gradient: Vec<f64> = equations.right.iter().map(|right| -right).collect();
        for (row, column, block) in equations.blocks() {
            let (row, column) = (row as usize, column as usize);
            for (entry, value) in block.iter().enumerate() {
                let (r, c) = (2 * row + entry / 2, 2 * column + entry % 2);
                gradient[r] += value * at[c];
                if row != column {
                    gradient[c] += value * at[r];
                }
            }
        }
        for unknown in (0..unknowns).step_by(3) {
            let moved = |by: f64| {
                let mut moved = at.clone();
                moved[unknown] += by;
                energy(&moved)
            };
            let numeric = (moved(0.5) - moved(-0.5)) / 2.0;
            prop_assert!((numeric - gradient[unknown]).abs() < 1e-6, "{unknown}: {numeric} {}", gradient[unknown]);
        }
    }
}
