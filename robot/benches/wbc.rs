//! Time of the control step and its parts, beside the peers'.
//!
//! `cargo xtask bench`, or `cargo bench -p locoman-robot --bench wbc`. All times are processor time of one
//! thread, so that what else runs on the machine counts little; what its interrupts still add to the last
//! percentiles shows in the first row, whose work is always the same. The peers were timed on the same kind of
//! machine with the same robot; where a program of theirs needs several calls for a step, they are added.

#![expect(clippy::expect_used, reason = "in a benchmark a panic is the report")]

mod scenes;

use std::hint::black_box;

use hdrhistogram::Histogram;
use locoman_protocol::clock::thread_cpu_ns;
use locoman_robot::{
    dynamics::Dynamics,
    wbc::{
        StepPart, WbcOutput, WbcSettings, WholeBodyController,
        force::{ActiveSet, ForceProblem, ForceSolver, InteriorPoint, MAX_FORCES},
    },
};
use scenes::{Scene, model, scenes, state};

/// Single steps that are timed.
const STEPS: u32 = 40_000;
/// Steps before them, for the processor to settle.
const WARM_UP: u32 = 2_000;
/// Multiplications, one after the other, that take about as long as a step.
const MULTIPLICATIONS: u32 = 30_000;

fn main() {
    let clock = clock_ns();
    println!("µs of processor time                             p50     p99   p99.9   peers' medians");
    time_machine(clock);
    time_dynamics(clock);
    let scenes = scenes();
    for scene in &scenes {
        time_forces(scene, clock);
    }
    for scene in &scenes {
        time_step(scene, clock, Method::ActiveSetFirst);
        time_step(scene, clock, Method::InteriorPointOnly);
    }
    print_shares(&scenes[1], clock);
}

/// How the contact forces are found.
#[derive(Debug, Clone, Copy)]
enum Method {
    ActiveSetFirst,
    InteriorPointOnly,
}

impl Method {
    fn controller(self) -> WholeBodyController {
        let controller = WholeBodyController::new(WbcSettings::default());
        match self {
            Self::ActiveSetFirst => controller,
            Self::InteriorPointOnly => controller.with_interior_point_only(),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::ActiveSetFirst => "active set first",
            Self::InteriorPointOnly => "Clarabel alone",
        }
    }
}

/// What the machine adds to the same work without memory.
fn time_machine(clock: u64) {
    let times = timed(clock, |_| {
        black_box((0..MULTIPLICATIONS).fold(black_box(1.0_f64), |product, _| product * 1.000_001 + 1e-6));
    });
    print_row("the machine: the same multiplications", &times, "");
}

fn time_dynamics(clock: u64) {
    let model = model();
    let mut sut = Dynamics::new();
    let times = timed(clock, |step| sut.update(&model, black_box(&state(step))));
    print_row(
        "dynamics: A, b, g, J and bias of seven frames",
        &times,
        "Pinocchio 8.1, dynibo 7.5, MuJoCo 4.4",
    );
}

/// The problems of a scene's steps, by both solvers.
fn time_forces(scene: &Scene, clock: u64) {
    let problems = problems(scene);
    let at = |step: u32| &problems[step as usize % problems.len()];
    let feet = problems[0].points;
    let mut forces = [0.0; MAX_FORCES];
    let mut sut = ActiveSet::default();
    let times = timed(clock, |step| {
        let _ = black_box(sut.solve(at(step), &mut forces));
    });
    let peers = ["", "", "quadprog 0.46", "quadprog 1.5, DAQP 5.3", "quadprog 2.2, DAQP 6.3"][feet];
    print_row(&format!("forces of {feet} feet, active set"), &times, peers);
    let mut sut = InteriorPoint::new(problems[0].friction);
    let times = timed(clock, |step| {
        let _ = black_box(sut.solve(at(step), &mut forces));
    });
    let peers = ["", "", "Clarabel as it comes 51", "as it comes 77", "as it comes 100"][feet];
    print_row(&format!("forces of {feet} feet, Clarabel"), &times, peers);
}

fn problems(scene: &Scene) -> Vec<ForceProblem> {
    let model = model();
    let mut controller = Method::ActiveSetFirst.controller();
    let mut output = WbcOutput::hold(state(0).position);
    (0..1000)
        .map(|step| {
            let state = state(13 * step);
            controller.step(&model, &state, &scene.objectives, &scene.contacts, &mut output);
            controller.force_problem().clone()
        })
        .collect()
}

fn time_step(scene: &Scene, clock: u64, method: Method) {
    let model = model();
    let mut sut = method.controller();
    let mut output = WbcOutput::hold(state(0).position);
    let times = timed(clock, |step| {
        sut.step(&model, black_box(&state(step)), &scene.objectives, &scene.contacts, &mut output);
    });
    print_row(&format!("step, {}, {}", scene.name, method.name()), &times, scene.peers);
}

/// What each part takes of the step.
fn print_shares(scene: &Scene, clock: u64) {
    let model = model();
    let mut sut = Method::ActiveSetFirst.controller();
    let mut output = WbcOutput::hold(state(0).position);
    let mut parts =
        [StepPart::Dynamics, StepPart::Hierarchy, StepPart::Forces].map(|part| (part, histogram()));
    let mut whole = histogram();
    for step in 0..STEPS + WARM_UP {
        let state = state(step);
        let start = thread_cpu_ns();
        let mut last = start;
        let done = |part| {
            let now = thread_cpu_ns();
            if let Some((_, times)) = parts.iter_mut().find(|(name, _)| *name == part) {
                times.saturating_record((now - last).saturating_sub(clock).max(1));
            }
            last = now;
        };
        sut.step_watched(&model, &state, &scene.objectives, &scene.contacts, &mut output, done);
        whole.saturating_record((thread_cpu_ns() - start).saturating_sub(4 * clock).max(1));
    }
    let median = |times: &Histogram<u64>| times.value_at_quantile(0.5) as f64 / 1e3;
    println!("\nof a step in {} mode, medians:", scene.name);
    for (part, times) in &parts {
        let share = 100.0 * median(times) / median(&whole);
        println!("  {:12} {:6.2} µs  {share:3.0} %", format!("{part:?}"), median(times));
    }
    println!("  whole        {:6.2} µs", median(&whole));
}

/// Processor times of single calls, without the clock's own.
fn timed(clock: u64, mut call: impl FnMut(u32)) -> Histogram<u64> {
    for step in 0..WARM_UP {
        call(step);
    }
    let mut times = histogram();
    for step in 0..STEPS {
        let start = thread_cpu_ns();
        call(step);
        times.saturating_record((thread_cpu_ns() - start).saturating_sub(clock).max(1));
    }
    times
}

/// Processor time between two readings of the clock, median.
fn clock_ns() -> u64 {
    timed(0, |_| {}).value_at_quantile(0.5)
}

fn histogram() -> Histogram<u64> {
    Histogram::new_with_bounds(1, 1_000_000_000, 3).expect("three digits")
}

fn print_row(name: &str, times: &Histogram<u64>, peers: &str) {
    let at = |quantile| times.value_at_quantile(quantile) as f64 / 1e3;
    println!("{name:45} {:7.2} {:7.2} {:7.2}   {peers}", at(0.5), at(0.99), at(0.999));
}
