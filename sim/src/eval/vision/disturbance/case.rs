//! The disturbances, as data.

use super::fault::Fault;
use crate::operator::event::{
    Bump, Cover, Events, Exposing, Look, Pass, Poster, Span, Tear, TearLook, Visitor, VisitorTags,
};
use crate::operator::motion::Home;

/// One film.
#[derive(Debug)]
pub struct Case {
    /// In figures.
    pub name: &'static str,
    /// Scene time of its end.
    pub end_s: f64,
    /// What happens, by rising time.
    pub happenings: Vec<Happening>,
    /// Before the lenses.
    pub events: Events,
}

/// One disturbance.
#[derive(Debug)]
pub struct Happening {
    /// In figures.
    pub name: String,
    /// From when on,
    pub from_s: f64,
    /// and from when on the shells have to recover.
    pub end_s: f64,
    /// Behind the lenses.
    fault: Option<Fault>,
    /// Whether it hides everything, so that what is lost has to be found within three frames of its end.
    pub bound: bool,
}

/// The camera that is bumped.
pub const BUMPED: usize = 0;
/// When something happens first.
const FIRST_S: f64 = 2.0;

impl Case {
    /// What is wrong with the frames of a moment.
    pub fn fault_at(&self, t_s: f64) -> Option<Fault> {
        let now =
            self.happenings.iter().find(|it| it.fault.is_some() && (it.from_s..it.end_s).contains(&t_s));
        now.and_then(|it| it.fault)
    }
}

/// All of them, before cameras with these ids.
pub fn all(ids: &[String]) -> Vec<Case> {
    let first = |count: usize| ids.iter().take(count).cloned().collect::<Vec<String>>();
    let mut cases = vec![
        covered("cover_one", &first(1)),
        covered("cover_two", &first(2)),
        covered("cover_all", &first(ids.len())),
    ];
    let until = |length_s: f64| Span { begin_s: FIRST_S, end_s: FIRST_S + length_s };
    let for_ever = until(f64::INFINITY);
    let camera = |index: usize| ids.get(index).cloned().unwrap_or_default();
    let home = |xyz: [f64; 3], rpy_deg: [f64; 3]| Home { xyz, rpy_deg };

    let pass = |camera| Pass { during_s: until(1.0), camera, distance_m: 0.3 };
    let events = Events { pass: vec![pass(camera(0)), pass(camera(3))], ..Events::default() };
    cases.push(single("hand_passes", 1.0, 1.0, events));

    for (name, tags) in [("visitor_other_ids", VisitorTags::Other), ("visitor_same_ids", VisitorTags::Same)] {
        let world_from_operator = home([-0.45, 0.35, 0.05], [0.0; 3]);
        let visitor = Visitor { during_s: until(2.0), tags, world_from_operator, delay_s: 0.5 };
        cases.push(single(name, 2.0, 1.0, Events { visitor: vec![visitor], ..Events::default() }));
    }

    // A tag of each palm, in the middle of what the cameras see.
    let tear = |id, look| Tear { during_s: for_ever, id, look };
    let tear = vec![tear(6, TearLook::Hanging), tear(18, TearLook::Hanging), tear(7, TearLook::Gone)];
    cases.push(single("tags_torn", 0.0, 2.0, Events { tear, ..Events::default() }));

    for (name, ids) in [("poster_other_ids", [500, 501, 502]), ("poster_same_ids", [0, 12, 24])] {
        let world_from_poster = home([-0.2, 0.0, 1.75], [90.0, 0.0, 90.0]);
        let poster = Poster { during_s: for_ever, ids: ids.to_vec(), size_m: 0.08, world_from_poster };
        cases.push(single(name, 0.0, 1.5, Events { poster: vec![poster], ..Events::default() }));
    }

    let light =
        |brightness, exposure_s| Exposing { during_s: until(1.0), cameras: vec![], brightness, exposure_s };
    for (name, exposing) in [
        ("exposure_halved", light(0.5, None)),
        ("exposure_doubled", light(2.0, None)),
        // At the 0.5 m/s of a reach, 0.7 m away: 10 px.
        ("blur_10px", light(1.0, Some(0.014))),
    ] {
        cases.push(single(name, 1.0, 1.0, Events { exposure: vec![exposing], ..Events::default() }));
    }

    let camera_from_bumped = home([0.02, 0.0, 0.0], [0.0; 3]);
    let bump = Bump { during_s: for_ever, camera: camera(BUMPED), camera_from_bumped };
    cases.push(single("bump_2cm", 0.0, 5.5, Events { bump: vec![bump], ..Events::default() }));
    cases.push(faults());
    cases
}

/// One that lasts for a time, filmed for some seconds more.
fn single(name: &'static str, length_s: f64, after_s: f64, events: Events) -> Case {
    let end_s = FIRST_S + length_s;
    let happening = Happening { name: name.to_owned(), from_s: FIRST_S, end_s, fault: None, bound: false };
    Case { name, end_s: end_s + after_s, happenings: vec![happening], events }
}

/// Lenses that are covered for 0.2, 1 and 5 s.
fn covered(name: &'static str, cameras: &[String]) -> Case {
    const PAUSE_S: f64 = 1.0;
    let (mut begin_s, mut happenings, mut events) = (FIRST_S, Vec::new(), Events::default());
    for length_s in [0.2, 1.0, 5.0] {
        let end_s = begin_s + length_s;
        let name = format!("{name}_{length_s}s");
        happenings.push(Happening { name, from_s: begin_s, end_s, fault: None, bound: true });
        let during_s = Span { begin_s, end_s };
        events.cover.push(Cover { during_s, cameras: cameras.to_vec(), look: Look::Hand });
        begin_s = end_s + PAUSE_S;
    }
    Case { name, end_s: begin_s, happenings, events }
}

/// Frames that come wrongly, one fault after the other.
fn faults() -> Case {
    const LENGTH_S: f64 = 1.0;
    const PAUSE_S: f64 = 0.5;
    let faults = [
        ("frames_out_of_order", Fault::OutOfOrder),
        ("frames_doubled", Fault::Doubled),
        ("clock_an_hour_fast", Fault::Hour),
        ("jpeg_damaged", Fault::Damaged),
        ("clock_20_ms_fast", Fault::TwentyMs),
    ];
    let mut begin_s = FIRST_S;
    let happenings = faults.map(|(name, fault)| {
        let (from_s, end_s) = (begin_s, begin_s + LENGTH_S);
        begin_s = end_s + PAUSE_S;
        Happening { name: name.to_owned(), from_s, end_s, fault: Some(fault), bound: false }
    });
    Case { name: "frames", end_s: begin_s, happenings: happenings.into(), events: Events::default() }
}
