//! Wrong poses called measured, counted for as long as one likes: hands of another seed every half minute, and chance decides
//! what disturbs them.
//!
//! `--part count --seconds 1700` makes a million instants by shells: 120 updates a second of five shells. That takes two
//! cores a night. The count is what matters, hence the least that a picture can cost: 720p, not compressed, one tracker.

use locoman_vision::track::Tracker;

use super::film::{Coding, Film};
use super::stage::Stage;
use super::tally::Tally;
use crate::operator::event::{
    Cover, Events, Exposing, Look, Pass, Span, Tear, TearLook, Visitor, VisitorTags,
};
use crate::operator::motion::Home;
use crate::operator::sensor::mix;
use crate::operator::wander::{Settings, Wander};

/// Images a second of each camera.
const RATE_HZ: f64 = 60.0;
/// Scene time by default.
pub const SECONDS: f64 = 10.0;
/// Scene time of one round, and of its begin.
const ROUND_S: f64 = 30.0;
const BEGIN_S: f64 = 1.0;

/// Plays rounds until so much scene time has passed; the ledger gets each as it ends.
pub fn run(
    stage: &Stage,
    seed: u64,
    seconds: f64,
    enter: &mut dyn FnMut(&str, &Tally) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let (mut left_s, mut random) = (seconds, mix(seed));
    while left_s > 0.0 {
        let round_s = left_s.min(ROUND_S);
        random = mix(random);
        let stage = round(stage, random, round_s)?;
        let mut tally = Tally::new(&stage.shells);
        let mut tracker: Tracker = stage.tracker()?;
        let film = Film {
            studio: &stage.studio,
            begin_s: BEGIN_S,
            seconds: round_s,
            rate_hz: RATE_HZ,
            coding: Coding::Raw,
        };
        film.show(|shot| {
            tally.add(&stage.studio, &shot, &tracker.update(&shot.frames));
            Ok(())
        })?;
        tracing::info!("seed {random}: {} instants by shells, {} wrong", tally.instants(), tally.wrong());
        enter("count", &tally)?;
        left_s -= round_s;
    }
    Ok(())
}

/// The scene with other motion, and other disturbances.
fn round(stage: &Stage, random: u64, seconds: f64) -> anyhow::Result<Stage> {
    let mut scene = stage.studio.scene().clone();
    let period_s = scene.motion.period_s;
    let settings = Settings { seed: random, begin_s: BEGIN_S, end_s: period_s - BEGIN_S, tremor_m: 0.0003 };
    scene.motion.wander = Some(Wander::try_from(settings)?);
    let ids: Vec<String> = stage.rig.cameras.iter().map(|camera| camera.id.clone()).collect();
    scene.events = events(&ids, random, seconds);
    stage.with_scene(scene)
}

/// One disturbance every two seconds, none of them for longer than one.
fn events(ids: &[String], mut random: u64, seconds: f64) -> Events {
    const EVERY_S: f64 = 2.0;
    let mut events = Events::default();
    let mut draw = || {
        random = mix(random);
        (random >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut begin_s = BEGIN_S + EVERY_S;
    while begin_s < BEGIN_S + seconds {
        let during_s = Span { begin_s, end_s: begin_s + 0.1 + 0.9 * draw() };
        let first = (draw() * ids.len() as f64) as usize;
        let cameras: Vec<String> = ids.iter().skip(first).cloned().collect();
        let camera = cameras.first().cloned().unwrap_or_default();
        match (draw() * 7.0) as usize {
            0 => events.cover.push(Cover { during_s, cameras, look: Look::Hand }),
            1 => events.cover.push(Cover { during_s, cameras: ids.to_vec(), look: Look::Black }),
            2 => events.pass.push(Pass { during_s, camera, distance_m: 0.25 + 0.3 * draw() }),
            3 => {
                let tags = if draw() < 0.5 { VisitorTags::Same } else { VisitorTags::Other };
                let xyz = [-0.6 + 0.3 * draw(), 0.8 * draw() - 0.4, 0.1 * draw()];
                let world_from_operator = Home { xyz, rpy_deg: [0.0, 0.0, 60.0 * draw() - 30.0] };
                events.visitor.push(Visitor { during_s, tags, world_from_operator, delay_s: 3.0 * draw() });
            }
            4 => events.tear.push(Tear { during_s, id: (draw() * 56.0) as u32, look: TearLook::Hanging }),
            5 => {
                let brightness = 0.4 * 5f64.powf(draw());
                events.exposure.push(Exposing { during_s, cameras, brightness, exposure_s: None });
            }
            _ => {
                let exposure_s = Some(0.004 + 0.012 * draw());
                events.exposure.push(Exposing { during_s, cameras, brightness: 1.0, exposure_s });
            }
        }
        begin_s += EVERY_S;
    }
    events
}
