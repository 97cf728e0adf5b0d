//! The allocation against quadratic programs in double precision, solved by Clarabel.
//!
//! The priorities are solved one after the other, each beside what the ones before have fixed: the largest
//! part of roll and pitch, the yaw torque that is least turned against its command, the thrust nearest to
//! its command, the yaw torque nearest to its own.

use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::NonnegativeConeT;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus};
use ctrl_core::allocation::Spin::{Anticlockwise as A, Clockwise as C};
use ctrl_core::allocation::{Allocation, Allocator, Limited, Rotor, RotorGeometry, RotorSet, Spin};
use ctrl_core::list::List;
use ctrl_core::vehicle::{Interval, Wrench};
use glam::Vec3;
use rayon::prelude::*;
use system_tests::random::Source;

const LIMITS: Interval = Interval { lower: 0.2, upper: 5.0 };
/// Wrenches of each vehicle.
const WRENCHES: u64 = if cfg!(feature = "exhaustive") { 10_000 } else { 1_000 };
/// Largest difference of the one in 1,000 that may exceed the vehicle's bounds.
const WORST: f64 = 5e-4;

/// A vehicle with the errors that its allocation may have beside the quadratic programs.
struct Case {
    name: &'static str,
    geometry: RotorGeometry,
    failed: RotorSet,
    /// Differences that 999 of 1,000 wrenches keep, over the range of each: roll and pitch, thrust, yaw.
    bounds: [f64; 3],
}

fn cases() -> Vec<Case> {
    let ring = |spins: &[Spin]| RotorGeometry::ring(spins, 0.3, 0.3, 0.02, LIMITS);
    let case =
        |name, geometry| Case { name, geometry, failed: RotorSet::empty(), bounds: [1e-5; 3] };
    let loose = |name, geometry| Case { bounds: [1e-5, 2e-4, 2e-4], ..case(name, geometry) };
    let octo = || ring(&[A, C, A, C, A, C, A, C]);
    let pairs = || ring(&[A, A, C, C, A, C]);
    vec![
        case("quadrotor, X", RotorGeometry::quad_x(0.2, 0.016, LIMITS)),
        loose("quadrotor, uneven", uneven(&[(0.2, 0.3), (-0.25, 0.2), (-0.2, -0.2), (0.3, -0.25)])),
        loose(
            "five rotors",
            uneven(&[(0.3, 0.1), (0.1, 0.35), (-0.3, 0.2), (-0.2, -0.3), (0.25, -0.2)]),
        ),
        case("hexarotor, alternating", ring(&[A, C, A, C, A, C])),
        case("hexarotor, in pairs", pairs()),
        case("octorotor", octo()),
        case("octorotor, coaxial", coaxial()),
        Case { failed: RotorSet::rotor(1), ..case("octorotor without one", octo()) },
        Case { failed: RotorSet::rotor(0), ..case("hexarotor, in pairs, without one", pairs()) },
    ]
}

fn uneven(places: &[(f32, f32)]) -> RotorGeometry {
    let spins = [C, A].into_iter().cycle();
    let rotors = places.iter().zip(spins).enumerate().map(|(index, ((x, y), spin))| Rotor {
        position_body: Vec3::new(*x, *y, 0.0),
        spin,
        torque_ratio: 0.015 + 0.002 * index as f32,
        thrust: Interval { upper: 5.0 + 0.3 * index as f32, ..LIMITS },
    });
    RotorGeometry { rotors: List::taking(rotors) }
}

/// Four pairs, one rotor above the other, of opposite spin.
fn coaxial() -> RotorGeometry {
    let upper = RotorGeometry::quad_x(0.25, 0.02, LIMITS).rotors;
    let lower = upper.iter().map(|rotor| {
        let spin = if rotor.spin == C { A } else { C };
        let position_body = rotor.position_body - 0.1 * Vec3::Z;
        Rotor { spin, position_body, ..*rotor }
    });
    RotorGeometry { rotors: List::taking(upper.iter().copied().chain(lower)) }
}

/// A linear function of the thrusts, and its least and largest value.
type Row = (Vec<f64>, f64, f64);

/// Difference that counts as none for the solver: what one priority has fixed may vary so much for the next.
const SLACK: f64 = 1e-6;

/// Minimises `(row . x - goal)^2`, or `row . x` itself without a goal, within `rows`.
fn solve((row, goal): (&[f64], Option<f64>), rows: &[Row]) -> Vec<f64> {
    let n = row.len();
    let (p, q) = match goal {
        None => (CscMatrix::zeros((n, n)), row.to_vec()),
        Some(goal) => {
            let upper = |i: usize, j: usize| if i <= j { 2.0 * row[i] * row[j] } else { 0.0 };
            let dense: Vec<Vec<f64>> =
                (0..n).map(|i| (0..n).map(|j| upper(i, j)).collect()).collect();
            (CscMatrix::from(&dense), row.iter().map(|r| -2.0 * goal * r).collect())
        }
    };
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for (row, least, most) in rows {
        a.push(row.clone());
        b.push(*most);
        a.push(row.iter().map(|r| -r).collect());
        b.push(-least);
    }
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: 1e-13,
        tol_gap_rel: 1e-13,
        tol_feas: 1e-10,
        max_iter: 100,
        ..DefaultSettings::default()
    };
    let cones = [NonnegativeConeT(b.len())];
    let mut solver =
        DefaultSolver::new(&p, &q, &CscMatrix::from(&a), &b, &cones, settings).unwrap();
    solver.solve();
    let status = solver.solution.status;
    let solved = [
        SolverStatus::Solved,
        SolverStatus::AlmostSolved,
        // Short of the tightened tolerance, which the comparison then shows.
        SolverStatus::InsufficientProgress,
    ];
    assert!(solved.contains(&status), "{status:?} {row:?} {goal:?} {rows:?}");
    solver.solution.x.clone()
}

/// (thrust, roll, pitch, yaw) over the ranges of the vehicle.
type Axes = [f64; 4];

/// Columns of `B` over `scale`, and limits of each rotor that works.
struct Program {
    columns: Vec<Axes>,
    limits: Vec<(f64, f64)>,
    scale: Axes,
}

impl Program {
    fn new(case: &Case) -> Self {
        let rotors = case.geometry.rotors.iter().enumerate();
        let works = rotors.filter(|(index, _)| !case.failed.contains(RotorSet::rotor(*index)));
        let columns: Vec<Axes> = works
            .clone()
            .map(|(_, rotor)| {
                let sign = if rotor.spin == C { 1.0 } else { -1.0 };
                let (x, y) = (rotor.position_body.x, rotor.position_body.y);
                [1.0, f64::from(y), -f64::from(x), sign * f64::from(rotor.torque_ratio)]
            })
            .collect();
        let limits: Vec<_> = works
            .map(|(_, rotor)| (f64::from(rotor.thrust.lower), f64::from(rotor.thrust.upper)))
            .collect();
        let scale = std::array::from_fn(|axis| {
            let most = |column: &Axes| column[axis].abs() * 5.0;
            columns.iter().map(most).sum()
        });
        let columns = columns
            .into_iter()
            .map(|column| std::array::from_fn(|axis| column[axis] / scale[axis]))
            .collect();
        Self { columns, limits, scale }
    }

    fn row(&self, axis: usize) -> Vec<f64> {
        self.columns.iter().map(|column| column[axis]).collect()
    }

    fn made(&self, axis: usize, thrusts: &[f64]) -> f64 {
        self.row(axis).iter().zip(thrusts).map(|(a, b)| a * b).sum()
    }

    /// Part of roll and pitch, thrust and yaw by the priorities.
    fn solve(&self, command: &Axes) -> [f64; 3] {
        let n = self.columns.len();
        let limits: Vec<Row> = self
            .limits
            .iter()
            .enumerate()
            .map(|(index, (least, most))| {
                let mut row = vec![0.0; n];
                row[index] = 1.0;
                (row, *least, *most)
            })
            .collect();
        let part = self.largest_part(command, &limits) - SLACK;
        let mut rows = limits;
        for axis in [1, 2] {
            rows.push((self.row(axis), part * command[axis], part * command[axis]));
        }
        let (yaw, thrust) = (self.row(3), self.row(0));
        let nearest_yaw = |goal: f64, rows: &[Row]| self.made(3, &solve((&yaw, Some(goal)), rows));
        let (least, most) = (nearest_yaw(0.0, &rows), nearest_yaw(command[3], &rows));
        let (lower, upper) = (least.min(most) - SLACK, least.max(most) + SLACK);
        rows.push((yaw.clone(), lower, upper));
        let nearest = self.made(0, &solve((&thrust, Some(command[0])), &rows));
        rows.pop();
        rows.push((thrust, nearest - SLACK, nearest + SLACK));
        [part, nearest, nearest_yaw(command[3], &rows)]
    }

    /// The largest `k` up to 1 for which `k` of roll and pitch can be made.
    fn largest_part(&self, command: &Axes, limits: &[Row]) -> f64 {
        let n = self.columns.len();
        let with = |row: &[f64], last: f64| {
            let mut row = row.to_vec();
            row.push(last);
            row
        };
        let mut rows: Vec<Row> =
            limits.iter().map(|(row, least, most)| (with(row, 0.0), *least, *most)).collect();
        rows.extend([1, 2].map(|axis| (with(&self.row(axis), -command[axis]), 0.0, 0.0)));
        let k = with(&vec![0.0; n], 1.0);
        rows.push((k.clone(), 0.0, 1.0));
        let less: Vec<f64> = k.iter().map(|k| -k).collect();
        solve((&less, None), &rows)[n]
    }
}

/// A command, over the ranges: half of them far beyond what the rotors can make.
fn command(source: &mut Source, index: u64) -> Axes {
    let reach = if index.is_multiple_of(2) { 0.4 } else { 1.5 };
    let torque = source.vector(-reach, reach);
    [source.number(-0.1, 1.2), torque.x, torque.y, torque.z]
}

fn differences(
    case: &Case,
    allocator: &Allocator,
    program: &Program,
    seed: u64,
) -> ([f64; 3], bool) {
    let command = command(&mut Source::new(seed), seed);
    let in_newtons = |axis: usize| (command[axis] * program.scale[axis]) as f32;
    let torque_body = Vec3::new(in_newtons(1), in_newtons(2), in_newtons(3));
    let wrench = Wrench { thrust: in_newtons(0), torque_body };
    let Allocation { thrusts, achieved, limited } = allocator.allocate(&wrench);
    for (rotor, (index, thrust)) in case.geometry.rotors.iter().zip(thrusts.iter().enumerate()) {
        let failed = case.failed.contains(RotorSet::rotor(index));
        assert!(if failed { *thrust == 0.0 } else { rotor.thrust.contains(*thrust) });
    }
    let made = allocator.wrench(&thrusts);
    let torque = achieved.torque_body;
    assert!((made.torque_body - torque).abs().max_element() < 2e-5, "{made:?} {achieved:?}");
    let achieved: Axes = [achieved.thrust, torque.x, torque.y, torque.z].map(f64::from);
    let achieved: Axes = std::array::from_fn(|axis| achieved[axis] / program.scale[axis]);
    let [part, thrust, yaw] = program.solve(&command);
    let length = command[1].hypot(command[2]);
    let got = (achieved[1] * command[1] + achieved[2] * command[2]) / (length * length);
    let across = (achieved[1] * command[2] - achieved[2] * command[1]).abs() / length;
    let differences = [
        (got - part).abs() * length + across,
        (achieved[0] - thrust).abs(),
        (achieved[3] - yaw).abs(),
    ];
    (differences, limited != Limited::empty())
}

#[test]
fn the_allocation_is_the_quadratic_programs() {
    for case in cases() {
        let allocator = Allocator::without(&case.geometry, case.failed).unwrap();
        let program = Program::new(&case);
        let all: Vec<_> = (0..WRENCHES)
            .into_par_iter()
            .map(|seed| differences(&case, &allocator, &program, seed))
            .collect();
        let limited = all.iter().filter(|(_, limited)| *limited).count();
        println!("{}: {limited} of {WRENCHES} limited", case.name);
        for (axis, bound) in ["tilt", "thrust", "yaw"].iter().zip(case.bounds).enumerate() {
            let (name, bound) = bound;
            let mut sorted: Vec<_> = all.iter().map(|(difference, _)| difference[axis]).collect();
            sorted.sort_by(f64::total_cmp);
            let at = |part: f64| sorted[(part * (sorted.len() - 1) as f64) as usize];
            let [most_of_them, worst] = [at(0.999), at(1.0)];
            println!("    {name}: 99.9 % within {most_of_them:.1e}, worst {worst:.1e}");
            assert!(most_of_them <= bound, "{}, {name}: {most_of_them}", case.name);
            assert!(worst <= WORST, "{}, {name}: {worst}", case.name);
        }
        assert!(limited as u64 > WRENCHES / 2, "commands must be beyond the limits, too");
    }
}
