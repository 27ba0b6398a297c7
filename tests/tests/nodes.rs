//! Camera nodes: a station fuses a pair of its cameras that another process reads, knows that node's clock, and goes on
//! without it.
//!
//! All programs play one recording, from one time, in slow motion: a busy machine may still have no time for some of
//! the images. That the way through a node changes no pose is shown without a clock, in `node_wire`.

#![expect(clippy::unwrap_used, reason = "a panic here is the report")]

use std::collections::BTreeMap;
use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use locoman_protocol::clock::monotonic_ns;
use locoman_protocol::geometry::isometry;
use locoman_protocol::messages::{ClockOffset, Tracking, Verdict};
use locoman_protocol::{Endpoints, Link, Subscription};
use locoman_tests::programs::{operator_recording, program, root};
use nalgebra::{Isometry3, Vector3};

/// The pair that the node reads.
const REMOTE: [&str; 2] = ["left_zed_left", "left_zed_right"];
/// Those that are followed.
const SHELLS: [&str; 2] = ["torso", "right_palm"];
/// Of the recorded speed.
const SPEED: f64 = 0.2;
/// From the recording's begin, as recorded: how much is compared, and after what. Before that the shells are found,
/// and which image is searched first is chance.
const COMPARED_S: std::ops::Range<f64> = 1.0..3.0;
/// Programs start, and a shared processor is slow at it.
const LEAD_NS: u64 = 4_000_000_000;
const PATIENCE: Duration = Duration::from_secs(60);

/// A program that ends with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Already gone is as good.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What all programs of a test share.
struct Stage {
    folder: tempfile::TempDir,
    recording: PathBuf,
    endpoint: String,
    start_ns: u64,
}

impl Stage {
    fn set() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let recording = operator_recording(folder.path()).unwrap();
        let rig = fs::read_to_string(root().join("configs/rigs/two_zed_pairs.toml")).unwrap();
        fs::write(folder.path().join("local.toml"), &rig).unwrap();
        let remote = REMOTE.iter().fold(rig, |rig, id| {
            let line = format!("id = \"{id}\"\n");
            assert!(rig.contains(&line));
            rig.replace(&line, &format!("{line}source = {{ remote = true }}\n"))
        });
        fs::write(folder.path().join("remote.toml"), remote).unwrap();
        // Two shells of five: half the work, for a machine that has other work too.
        let shells = fs::read_to_string(root().join("configs/shells/standard.toml")).unwrap();
        let (head, rest) = shells.split_at(shells.find("[[shell]]\n").unwrap());
        let followed = |text: &&str| SHELLS.iter().any(|name| text.contains(&format!("name = \"{name}\"")));
        let shells: String =
            rest.split("[[shell]]\n").filter(followed).map(|text| format!("[[shell]]\n{text}")).collect();
        fs::write(folder.path().join("shells.toml"), head.to_owned() + &shells).unwrap();
        let settings = fs::read_to_string(root().join("configs/teleop.toml")).unwrap();
        assert!(settings.contains("straggler_ms = 5"));
        // In slow motion there is time to wait for every camera.
        let settings = settings.replace("straggler_ms = 5", "straggler_ms = 100");
        fs::write(folder.path().join("teleop.toml"), settings).unwrap();
        let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let endpoint = format!("tcp/127.0.0.1:{port}");
        Self { folder, recording, endpoint, start_ns: monotonic_ns() + LEAD_NS }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn start(&self, task: &[&str], rig: &str, log: &str) -> Running {
        let mut command = program("locoman-teleop").unwrap();
        let log = fs::File::create(self.path(log)).unwrap();
        command.arg("--configs").arg(self.folder.path()).args(task);
        command.arg("--replay").arg(&self.recording).arg("--rig").arg(self.path(rig));
        command.arg("--shells").arg(self.path("shells.toml")).args(["--speed", &SPEED.to_string()]);
        command.args(["--replay-at", &self.start_ns.to_string()]);
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log);
        Running(command.spawn().unwrap())
    }

    fn station(&self, rig: &str) -> (Running, Listener) {
        let task = ["run", "--console", "127.0.0.1:0", "--listen", &self.endpoint];
        let task = [&task[..], &["--connect", "tcp/127.0.0.1:9"]].concat();
        (self.start(&task, rig, "station.log"), Listener::connect(&self.endpoint))
    }

    /// Positions by the offline tracker.
    fn offline(&self) -> BTreeMap<Key, Vector3<f64>> {
        let table = self.path("poses.csv");
        let output = program("locoman-teleop")
            .unwrap()
            .arg("track")
            .arg(&self.recording)
            .arg("--rig")
            .arg(self.path("local.toml"))
            .arg("--shells")
            .arg(self.path("shells.toml"))
            .arg("-o")
            .arg(&table)
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut first_ns = None;
        let mut positions = BTreeMap::new();
        for row in fs::read_to_string(table).unwrap().lines().skip(1) {
            let cells: Vec<&str> = row.split(',').collect();
            let time_ns: u64 = cells[0].parse().unwrap();
            let since_ns = time_ns - *first_ns.get_or_insert(time_ns);
            let position =
                Vector3::from_iterator(cells[2..5].iter().map(|cell| cell.parse::<f64>().unwrap()));
            positions.insert(((since_ns as f64 * 1e-6).round() as u64, cells[1].to_owned()), position);
        }
        positions
    }

    fn node(&self, more: &[&str]) -> Running {
        let cameras = REMOTE.join(",");
        let task = ["detect", "--cameras", &cameras, "--connect", &self.endpoint];
        self.start(&[&task[..], more].concat(), "remote.toml", "node.log")
    }
}

/// Time in the recording, in whole milliseconds, and shell.
type Key = (u64, String);

/// Hears what a station tracks.
struct Listener {
    heard: Arc<Mutex<Vec<Tracking>>>,
    _subscription: Subscription,
    _link: Link,
}

impl Listener {
    fn connect(endpoint: &str) -> Self {
        let link = Link::open("locoman", &Endpoints::connect(&[endpoint])).unwrap();
        let heard = Arc::new(Mutex::new(Vec::new()));
        let to = Arc::clone(&heard);
        let subscription =
            link.subscribe::<Tracking>(move |received| to.lock().unwrap().push(received.message)).unwrap();
        Self { heard, _subscription: subscription, _link: link }
    }

    fn last(&self) -> Option<Tracking> {
        self.heard.lock().unwrap().last().cloned()
    }

    fn wait_until<T>(&self, what: &str, mut found: impl FnMut(&Tracking) -> Option<T>) -> T {
        let start = Instant::now();
        loop {
            if let Some(value) = self.last().as_ref().and_then(&mut found) {
                return value;
            }
            assert!(start.elapsed() < PATIENCE, "waited in vain for {what}; heard last: {:?}", self.last());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Poses and the number of cameras behind them.
    fn poses(&self, start_ns: u64) -> BTreeMap<Key, (Isometry3<f64>, u32)> {
        let mut poses = BTreeMap::new();
        for tracking in self.heard.lock().unwrap().iter() {
            let capture_ns = tracking.header.map_or(0, |header| header.capture_ns);
            let at_s = (capture_ns as f64 - start_ns as f64) * 1e-9 * SPEED;
            if !COMPARED_S.contains(&at_s) {
                continue;
            }
            for shell in tracking.shells.iter().filter(|shell| shell.verdict() == Verdict::Tracked) {
                let pose = isometry(shell.pose.as_ref().unwrap()).unwrap();
                let at_ms = (at_s * 1e3).round() as u64;
                poses.insert((at_ms, shell.shell.clone()), (pose, shell.cameras));
            }
        }
        poses
    }
}

fn clock(tracking: &Tracking) -> Option<ClockOffset> {
    tracking.cameras.iter().find(|camera| camera.camera == REMOTE[0])?.clock
}

fn wait_for_the_end(stage: &Stage) {
    let end_ns = stage.start_ns + (COMPARED_S.end / SPEED * 1e9) as u64 + 500_000_000;
    std::thread::sleep(Duration::from_nanos(end_ns.saturating_sub(monotonic_ns())));
}

fn log(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_default()
}

#[test]
fn a_pair_read_by_a_node_is_fused_with_one_read_here() {
    /// Of half the poses, from those of the offline tracker: it had time for all images. What this machine has no time
    /// for costs accuracy; that nothing else does is the test `node_wire`.
    const AGREE_M: f64 = 1e-3;

    let stage = Stage::set();
    let offline = stage.offline();
    let stage = Stage { start_ns: monotonic_ns() + LEAD_NS, ..stage };
    let (_station, listener) = stage.station("remote.toml");
    let _node = stage.node(&[]);
    wait_for_the_end(&stage);
    let offset = clock(&listener.last().unwrap()).expect("the node's clock is known");
    assert!(offset.offset_ns.unsigned_abs() <= offset.error_ns, "one clock, and its bound holds: {offset:?}");

    let poses = listener.poses(stage.start_ns);
    assert!(poses.values().any(|(_, cameras)| *cameras > 2), "shells are seen by cameras of both");
    let distance_m = |(key, (pose, _)): (&Key, &(Isometry3<f64>, u32))| {
        Some((pose.translation.vector - offline.get(key)?).norm())
    };
    let mut off_m: Vec<f64> = poses.iter().filter_map(distance_m).collect();
    off_m.sort_by(f64::total_cmp);
    let median_m = off_m.get(off_m.len() / 2).copied().expect("instants of both");
    println!("{} poses, half of them within {median_m} m; {offset:?}", off_m.len());
    assert!(median_m < AGREE_M, "{median_m} m: {}", log(&stage.path("node.log")));
}

#[test]
fn a_node_with_another_clock_is_understood_and_when_it_dies_the_others_go_on() {
    const SHIFT_MS: f64 = 1234.5;
    const FOUND_MS: f64 = 0.5;

    let stage = Stage::set();
    let (_station, listener) = stage.station("remote.toml");
    let node = stage.node(&["--clock-shift-ms", &SHIFT_MS.to_string()]);
    let offset = listener
        .wait_until("the node's clock", |tracking| clock(tracking).filter(|offset| offset.exchanges >= 10));
    // Station = node + offset: the node is ahead.
    let error_ms = offset.offset_ns as f64 * 1e-6 + SHIFT_MS;
    assert!(error_ms.abs() < FOUND_MS, "{offset:?}");
    assert!(error_ms.abs() <= offset.error_ns as f64 * 1e-6, "its bound holds: {offset:?}");
    let seen_by = |tracking: &Tracking, least: u32| {
        let palm = tracking.shells.iter().find(|shell| shell.shell == "torso")?;
        (palm.verdict() == Verdict::Tracked && palm.cameras >= least).then_some(())
    };
    listener.wait_until("a shell seen by cameras of both", |tracking| seen_by(tracking, 3));

    drop(node);
    let start = Instant::now();
    while !log(&stage.path("station.log")).contains("left_zed_left is silent; the others go on") {
        assert!(start.elapsed() < PATIENCE, "nobody says that the node is silent");
        std::thread::sleep(Duration::from_millis(50));
    }
    let died_ns = monotonic_ns();
    listener.wait_until("the other pair to go on", |tracking| {
        let fresh = tracking.header.is_some_and(|header| header.capture_ns > died_ns);
        seen_by(tracking, 1).filter(|()| fresh)
    });
}
