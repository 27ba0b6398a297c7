//! What CI runs, and what a person runs before pushing.

use anyhow::{Context, Result, bail};

use crate::{demo, setup, shell};

#[derive(clap::Args)]
pub struct Args {
    /// Leave out the headless demo.
    #[arg(long)]
    no_demo: bool,
}

/// Formatting, clippy without warnings, all tests and doc tests, a headless demo whose figures hold.
pub fn run(args: &Args) -> Result<()> {
    setup::ensure(setup::Purpose::Test)?;
    shell::cargo(&["fmt", "--all", "--check"]).context("run `cargo fmt`")?;
    shell::cargo(&["clippy", "--workspace", "--all-targets", "--", "--deny", "warnings"])?;
    // The whole-system tests start the programs; `cargo test` alone builds only some of them.
    shell::cargo(&["build", "--workspace", "--bins"])?;
    let operator = std::path::absolute(demo::operator_recording()?)?;
    shell::run(
        shell::cargo_command().args(["test", "--workspace"]).env("LOCOMAN_OPERATOR_RECORDING", operator),
    )?;
    if !args.no_demo {
        headless_demo()?;
    }
    Ok(())
}

/// Long enough to stand up, change the mode and follow the operator for a while.
const DEMO_SECONDS: f64 = 20.0;

fn headless_demo() -> Result<()> {
    let report = shell::target_dir().join("demo").join("report.json");
    demo::run(&demo::Args::headless(DEMO_SECONDS, &report))?;
    let text = std::fs::read_to_string(&report)?;
    let report: serde_json::Value = serde_json::from_str(&text)?;
    let figures = report["figures"].as_array().context("the demo's report holds no figures")?;
    let missed: Vec<String> = figures
        .iter()
        .filter(|figure| !holds(figure))
        .map(|figure| {
            format!("{} = {} {}, must be {}", figure["name"], figure["value"], figure["unit"], figure["must"])
        })
        .collect();
    if !missed.is_empty() {
        bail!("the headless demo misses its figures:\n  {}", missed.join("\n  "));
    }
    Ok(())
}

/// Whether a figure meets its `must` ("<= 5", ">= 0.98", "== 0"); one without is only reported.
fn holds(figure: &serde_json::Value) -> bool {
    let Some(must) = figure["must"].as_str() else { return true };
    let (Some((relation, limit)), Some(value)) = (must.split_once(' '), figure["value"].as_f64()) else {
        return false;
    };
    let Ok(limit) = limit.parse::<f64>() else { return false };
    match relation {
        "<" => value < limit,
        "<=" => value <= limit,
        ">" => value > limit,
        ">=" => value >= limit,
        "==" => value == limit,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::holds;

    #[test]
    fn a_figure_holds_only_if_it_meets_its_must() {
        assert!(holds(&json!({ "value": 4.9, "must": "<= 5" })));
        assert!(!holds(&json!({ "value": 5.1, "must": "<= 5" })));
        assert!(holds(&json!({ "value": 0, "must": "== 0" })));
        assert!(holds(&json!({ "value": 7.0, "must": null })));
        assert!(!holds(&json!({ "value": null, "must": "<= 5" })));
        assert!(!holds(&json!({ "value": 1.0, "must": "about 5" })));
    }
}
