//! The figures, and two tables for people: trajectories by kind, disturbances by case.

use std::fmt::Write as _;

use super::monitor::Findings;
use super::targets::Kind;
use super::trial::{self, Case};
use super::wander;
use crate::eval::statistics::{mean, percentile};
use crate::eval::{Figure, Must, Report};

/// All figures and both tables.
pub fn report(wandered: &[wander::Outcome], trials: &[(Case, trial::Outcome)], seed: u64) -> Report {
    let mut report = Report::new("robustness", seed);
    let mut table = String::new();
    if !wandered.is_empty() {
        trajectories(&mut report, &mut table, wandered);
    }
    if !trials.is_empty() {
        disturbances(&mut report, &mut table, trials);
    }
    report.table = Some(table);
    report
}

/// What must never happen.
fn musts(report: &mut Report, name: &str, findings: &Findings) {
    let mut never = |what: &str, value: f64, unit: &'static str, most: f64| {
        report.push(Figure::new(format!("{name}.{what}"), value, unit).must(Must::AtMost(most)));
    };
    never("falls", findings.falls as f64, "", 0.0);
    never("interventions", findings.interventions as f64, "", 0.0);
    never("not_finite", findings.not_finite as f64, "", 0.0);
    never("position_over", findings.position_over_rad.value, "rad", 0.0);
    never("speed_share", findings.speed_share.value, "", 1.0);
    never("torque_share", findings.torque_share.value, "", 1.0);
    never("self_contacts", findings.self_contacts as f64, "", 0.0);
    never("ground_contacts", findings.ground_contacts as f64, "", 0.0);
}

const FINDINGS_HEAD: &str = "falls stopped  NaN over,rad  speed torque  self ground";

fn findings(table: &mut String, findings: &Findings) {
    let _ = write!(
        table,
        "{:5} {:7} {:4} {:8.4} {:5.0}% {:5.0}% {:5} {:6}",
        findings.falls,
        findings.interventions,
        findings.not_finite,
        findings.position_over_rad.value,
        100.0 * findings.speed_share.value,
        100.0 * findings.torque_share.value,
        findings.self_contacts,
        findings.ground_contacts,
    );
}

/// Which joints broke a limit, on a line of its own.
fn places(table: &mut String, findings: &Findings) {
    if let Some(broken) = findings.broken() {
        let _ = writeln!(table, "{:12} {broken}", "");
    }
}

fn trajectories(report: &mut Report, table: &mut String, outcomes: &[wander::Outcome]) {
    let _ = writeln!(
        table,
        "{:12} {:>5}  {FINDINGS_HEAD}  {:>8} {:>7} {:>7} {:>7} {:>9} {:>9} {:>8} {:>9}",
        "trajectories",
        "count",
        "withheld",
        "error",
        "max",
        "tremor",
        "back, mm",
        "back, rad",
        "jerk",
        "recovered"
    );
    let kinds = Kind::ALL.into_iter().map(Some).chain([None]);
    for kind in kinds {
        let of_kind: Vec<&wander::Outcome> =
            outcomes.iter().filter(|outcome| kind.is_none_or(|kind| outcome.kind == kind)).collect();
        let name = kind.map_or("all", Kind::name);
        let mut found = Findings::default();
        for outcome in &of_kind {
            found.add(&outcome.findings);
        }
        let all = |of: fn(&wander::Outcome) -> f64| of_kind.iter().map(|o| of(o)).collect::<Vec<_>>();
        let most = |samples: Vec<f64>| samples.into_iter().fold(0.0, f64::max);
        let back = |of: fn((f64, f64)) -> f64| {
            most(of_kind.iter().filter_map(|outcome| outcome.recovery.map(of)).collect())
        };
        let figures = [
            ("withheld_max", most(all(|o| o.withheld_mm)), "mm"),
            ("error_mean", mean(&all(|o| o.error_mm[0])), "mm"),
            ("error_max", most(all(|o| o.error_mm[1])), "mm"),
            ("tremor_max", most(all(|o| o.tremor_mm)), "mm"),
            ("recovery_mm", back(|(mm, _)| mm), "mm"),
            ("recovery_rad", back(|(_, rad)| rad), "rad"),
            ("jerk_peak", most(all(|o| o.jerk)), "m/s3"),
        ];
        let _ = write!(table, "{name:12} {:5}  ", of_kind.len());
        findings(table, &found);
        let recovered = of_kind.iter().filter(|outcome| outcome.has_recovered()).count();
        let share = recovered as f64 / of_kind.len() as f64;
        let [withheld, error, worst, tremor, back_mm, back_rad, jerk] = figures.map(|(_, value, _)| value);
        let _ = writeln!(
            table,
            "  {withheld:8.1} {error:7.2} {worst:7.1} {tremor:7.2} {back_mm:9.2} {back_rad:9.4} {jerk:8.0} {:8.1}%",
            100.0 * share
        );
        places(table, &found);
        let prefix = format!("trajectories.{name}");
        report.push(Figure::new(format!("{prefix}.count"), of_kind.len() as f64, ""));
        musts(report, &prefix, &found);
        for (what, value, unit) in figures {
            report.push(Figure::new(format!("{prefix}.{what}"), value, unit));
        }
        report.push(Figure::new(format!("{prefix}.recovered_share"), share, ""));
        report.push(Figure::new(
            format!("{prefix}.tremor_p99"),
            percentile(&all(|o| o.tremor_mm), 0.99),
            "mm",
        ));
    }
    let share = outcomes.iter().filter(|outcome| outcome.findings.is_over()).count() as f64;
    let lost = Figure::new("trajectories.lost_share", share / outcomes.len() as f64, "");
    report.push(
        lost.must(Must::AtMost(0.0)).reference(1.0 / 24.0, "authors' controller, 24 mild ones, MuJoCo"),
    );
}

fn disturbances(report: &mut Report, table: &mut String, trials: &[(Case, trial::Outcome)]) {
    let _ = writeln!(
        table,
        "{:18}  {FINDINGS_HEAD}  {:>13} {:>13} {:>13} {:>9} {:>8}",
        "disturbances", "jerk t, g", "error t, g", "settling t, g", "last mm/s", "slip, mm"
    );
    for case in Case::ALL {
        let of_case: Vec<&trial::Outcome> =
            trials.iter().filter(|(other, _)| *other == case).map(|(_, outcome)| outcome).collect();
        let name = case.name();
        let mut found = Findings::default();
        for outcome in &of_case {
            found.add(&outcome.findings);
        }
        let most = |of: &dyn Fn(&trial::Outcome) -> f64| of_case.iter().map(|o| of(o)).fold(0.0, f64::max);
        let pair = |of: fn(&trial::Outcome) -> [f64; 2]| [0, 1].map(|body| most(&|o| of(o)[body]));
        let (jerk, error, settling) = (pair(|o| o.jerk), pair(|o| o.error_mm), pair(|o| o.settling_s));
        let last = most(&|o| o.last_speed_mm_s);
        let _ = write!(table, "{name:18}  ");
        findings(table, &found);
        let _ = writeln!(
            table,
            "  {:6.0} {:6.0} {:6.1} {:6.1} {:6.2} {:6.2} {last:9.1} {:8.1}",
            jerk[0], jerk[1], error[0], error[1], settling[0], settling[1], found.slip_mm
        );
        musts(report, &name, &found);
        for (place, body) in ["torso", "gripper"].into_iter().enumerate() {
            report.push(Figure::new(format!("{name}.{body}.jerk_peak"), jerk[place], "m/s3"));
            report.push(Figure::new(format!("{name}.{body}.error_max"), error[place], "mm"));
            report.push(Figure::new(format!("{name}.{body}.settling"), settling[place], "s"));
        }
        report.push(Figure::new(format!("{name}.gripper.last_speed"), last, "mm/s"));
        report.push(Figure::new(format!("{name}.slip"), found.slip_mm, "mm"));
        places(table, &found);
    }
}
