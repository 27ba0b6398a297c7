//! True errors over time of every task, and the square that the gripper drew.

use std::path::Path;

use anyhow::Context;
use locoman_robot::joints::Side;
use nalgebra::Vector3;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::measure::{BodyErrors, Run};
use super::task::Task;
use crate::eval::body::Body;
use crate::robot::EXCHANGE_S;

const SIZE_PX: (u32, u32) = (1200, 1260);
const ESTIMATE: RGBColor = RGBColor(0, 114, 178);
const TRUTH: RGBColor = RGBColor(230, 120, 0);
const DESIRED: RGBColor = RGBColor(0, 0, 0);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Draws the runs of the harder profile there is, as SVG: position errors of limb and torso for each task, and
/// the square from the side and from above.
pub fn draw(path: &Path, runs: &[Run]) -> anyhow::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let profile = if runs.iter().any(|run| run.profile == "hw") { "hw" } else { "ideal" };
    let area = SVGBackend::new(path, SIZE_PX).into_drawing_area();
    area.fill(&WHITE)?;
    let tasks: Vec<Task> =
        Task::ALL.into_iter().filter(|task| runs.iter().any(|run| run.task == *task)).collect();
    let square = runs.iter().find(|run| run.task == Task::Square && run.profile == profile);
    let rows = tasks.len() + usize::from(square.is_some());
    let panels = area.split_evenly((rows.max(1), 2));
    for (row, task) in tasks.iter().enumerate() {
        let of_task: Vec<&Run> =
            runs.iter().filter(|run| run.task == *task && run.profile == profile).collect();
        let torso: Vec<&BodyErrors> = of_task.iter().map(|run| &run.torso).collect();
        let limb: Vec<&BodyErrors> = of_task.iter().filter_map(|run| run.limb.as_ref()).collect();
        errors(&panels[2 * row], &format!("{} ({profile}): torso, mm", task.name()), &torso)?;
        let name = task.limb(Side::Right).map_or("", Body::name);
        errors(&panels[2 * row + 1], &format!("{} ({profile}): {name}, mm", task.name()), &limb)?;
    }
    if let Some(limb) = square.and_then(|run| run.limb.as_ref()) {
        path_seen(&panels[2 * tasks.len()], "square from the side: x, z in mm", limb, |p| (p.x, p.z))?;
        path_seen(&panels[2 * tasks.len() + 1], "square from above: x, y in mm", limb, |p| (p.x, p.y))?;
    }
    area.present().context("the file cannot be written")
}

/// A line for each run: estimate and truth.
fn errors(area: &Area<'_>, caption: &str, runs: &[&BodyErrors]) -> anyhow::Result<()> {
    let samples = || runs.iter().flat_map(|run| run.truth.position.iter().chain(&run.estimate.position));
    let top = samples().copied().fold(0.0, f64::max);
    let count = runs.iter().map(|run| run.truth.position.len()).max().unwrap_or(0);
    if count == 0 || top <= 0.0 {
        return Ok(());
    }
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 15))
        .margin(6)
        .x_label_area_size(22)
        .y_label_area_size(40)
        .build_cartesian_2d(0.0..count as f64 * EXCHANGE_S, 0.0..1.3 * top)?;
    chart.configure_mesh().light_line_style(WHITE).y_labels(5).draw()?;
    for (name, colour, of) in [("truth", TRUTH, true), ("estimator", ESTIMATE, false)] {
        for (i, run) in runs.iter().enumerate() {
            let series = if of { &run.truth } else { &run.estimate };
            // A file of moderate size: every fourth tick.
            let points = series.position.iter().enumerate().step_by(4);
            let line = points.map(|(tick, error)| ((tick + 1) as f64 * EXCHANGE_S, *error));
            let drawn = chart.draw_series(LineSeries::new(line, colour.mix(0.6).stroke_width(1)))?;
            if i == 0 {
                drawn
                    .label(name)
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
            }
        }
    }
    legend(&mut chart, SeriesLabelPosition::UpperRight)
}

/// Where the limb should have been, and was, seen along an axis.
fn path_seen(
    area: &Area<'_>,
    caption: &str,
    limb: &BodyErrors,
    seen: fn(&Vector3<f64>) -> (f64, f64),
) -> anyhow::Result<()> {
    let place = |which: usize| {
        limb.path.iter().map(move |pair| {
            let (x, y) = seen(&pair[which]);
            (1e3 * x, 1e3 * y)
        })
    };
    let range = |of: fn(&(f64, f64)) -> f64| {
        let all = place(0).chain(place(1)).map(|point| of(&point));
        let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        low - 10.0..high + 10.0
    };
    let mut chart = ChartBuilder::on(area)
        .caption(caption, ("sans-serif", 15))
        .margin(6)
        .x_label_area_size(22)
        .y_label_area_size(40)
        .build_cartesian_2d(range(|p| p.0), range(|p| p.1))?;
    chart.configure_mesh().light_line_style(WHITE).draw()?;
    for (which, name, colour, width) in [(0, "desired", DESIRED, 3), (1, "true", TRUTH, 1)] {
        chart
            .draw_series(LineSeries::new(place(which), colour.stroke_width(width)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    legend(&mut chart, SeriesLabelPosition::MiddleMiddle)
}

fn legend<'a, 'b: 'a, C>(
    chart: &mut ChartContext<'a, SVGBackend<'b>, C>,
    position: SeriesLabelPosition,
) -> anyhow::Result<()>
where
    C: CoordTranslate,
{
    chart.configure_series_labels().position(position).background_style(WHITE.mix(0.8)).draw()?;
    Ok(())
}
