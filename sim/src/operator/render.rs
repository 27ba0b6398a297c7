//! Light that falls on each pixel, before lens blur and sensor: background, limbs, shells.
//!
//! Work goes where the picture needs it. A tile without shells is probed every 4 pixels and interpolated
//! where all four probes agree. A tile with shells is probed at each pixel's corners at both ends of the
//! exposure, and in between where something moves far; where all agree the pixel is their mean, elsewhere 16
//! samples are spread over the pixel and over the exposure (stratified in space, permuted in time), which gives
//! motion blur and smooth edges.

use super::lens::{PixelRays, RayTable};
use super::shutter::SLICES;
use super::view::{BAND_ROWS, Bounds, Candidates, Hit, Lamp, Pace, View};

/// Side of a tile in pixels.
const TILE: usize = BAND_ROWS;
/// Distance of probes in a tile without shells.
const STEP: usize = 4;
/// Samples along each side of a pixel at an edge.
const GRID: usize = 4;

/// What one exposure needs.
#[derive(Debug, Clone, Copy)]
pub struct Exposure<'a> {
    /// Facets and limbs.
    pub view: &'a View,
    /// The lens.
    pub rays: &'a RayTable,
    /// The light.
    pub lamp: &'a Lamp,
    /// Light from the room behind, one value a pixel.
    pub background: &'a [f32],
    /// Width of the image.
    pub width: usize,
    /// How often the samples of an edge are drawn anew; 1 leaves edges with some hundredths of their contrast as error.
    pub draws: u32,
    /// Decides where samples lie.
    pub seed: u64,
}

/// The light on each pixel, by rows.
pub fn render(exposure: &Exposure<'_>) -> Vec<f32> {
    let mut light = exposure.background.to_vec();
    let height = light.len() / exposure.width;
    let columns = exposure.width.div_ceil(TILE);
    for (index, tile) in sort_into_tiles(exposure, columns, height.div_ceil(TILE)).iter().enumerate() {
        let (left, top) = (index % columns * TILE, index / columns * TILE);
        let area =
            Area { left, top, right: (left + TILE).min(exposure.width), bottom: (top + TILE).min(height) };
        if !tile.facets.is_empty() {
            area.render_shells(exposure, tile, &mut light);
        } else if !tile.limbs.is_empty() {
            area.render_limbs(exposure, tile, &mut light);
        }
    }
    light
}

fn sort_into_tiles(exposure: &Exposure<'_>, columns: usize, rows: usize) -> Vec<Candidates> {
    let mut tiles = vec![Candidates::default(); columns * rows];
    let span = |low: f64, high: f64, count: usize| {
        let tile = TILE as f64;
        ((low / tile).floor().max(0.0) as usize)..(((high / tile).floor() + 1.0).max(0.0) as usize).min(count)
    };
    let across = |bounds: &Bounds| span(bounds.left, bounds.right, columns);
    let down = |bounds: &Bounds| span(bounds.top, bounds.bottom, rows);
    for (number, bounds) in &exposure.view.placed_facets() {
        for row in down(bounds) {
            for column in across(bounds) {
                tiles[row * columns + column].facets.push(*number);
            }
        }
    }
    let (mut band, mut limbs) = (0, exposure.view.placed_limbs(0));
    for (row, line) in tiles.chunks_mut(columns).enumerate() {
        let own = exposure.view.band_of(row * TILE);
        if own != band {
            (band, limbs) = (own, exposure.view.placed_limbs(own));
        }
        for (number, bounds) in limbs.iter().filter(|(_, bounds)| down(bounds).contains(&row)) {
            for column in across(bounds) {
                line[column].limbs.push(*number);
            }
        }
        for tile in line {
            tile.band = band;
        }
    }
    tiles
}

/// A rectangle of pixels; `right` and `bottom` are outside.
#[derive(Debug, Clone, Copy)]
struct Area {
    left: usize,
    top: usize,
    right: usize,
    bottom: usize,
}

impl Area {
    fn render_shells(&self, exposure: &Exposure<'_>, tile: &Candidates, light: &mut [f32]) {
        let stride = TILE + 1;
        let pace = tile.facets.iter().map(|facet| exposure.view.pace_of(*facet)).max();
        let mut probes = [Probe::default(); (TILE + 1) * (TILE + 1)];
        for row in self.top..=self.bottom {
            for column in self.left..=self.right {
                let ray = exposure.rays.corner(column, row);
                let at = (row - self.top) * stride + column - self.left;
                let own_row = row.min(self.bottom - 1);
                let trace = |slice| exposure.view.trace(tile, ray, own_row, slice, exposure.lamp);
                probes[at] = Probe::new(pace.unwrap_or(Pace::Still), trace);
            }
        }
        let mut near = Candidates::default();
        for row in self.top..self.bottom {
            for column in self.left..self.right {
                let at = (row - self.top) * stride + column - self.left;
                let corners = [&probes[at], &probes[at + 1], &probes[at + stride], &probes[at + stride + 1]];
                let pixel = &mut light[row * exposure.width + column];
                let agree = corners.iter().all(|probe| probe.steady);
                match uniform(corners.iter().flat_map(|probe| &probe.ends)) {
                    Uniform::Nothing if agree => {}
                    Uniform::Surface(mean) if agree => *pixel = mean,
                    _ => {
                        let rays = exposure.rays.pixel(column, row);
                        exposure.view.narrow(tile, &rays.corners(), &mut near);
                        *pixel = sampled(exposure, &near, &rays, (column, row), *pixel);
                    }
                }
            }
        }
    }

    fn render_limbs(&self, exposure: &Exposure<'_>, tile: &Candidates, light: &mut [f32]) {
        const PROBES: usize = TILE / STEP + 1;
        let probe = |column: usize, row: usize| {
            let ray = exposure.rays.corner(column, row);
            exposure.view.trace(tile, ray, row, SLICES / 2, exposure.lamp)
        };
        let place = |i: usize, start: usize, end: usize| (start + i * STEP).min(end);
        let mut probes = [[None::<Hit>; PROBES]; PROBES];
        for (i, line) in probes.iter_mut().enumerate() {
            for (j, hit) in line.iter_mut().enumerate() {
                *hit = probe(place(j, self.left, self.right), place(i, self.top, self.bottom));
            }
        }
        for i in 0..PROBES - 1 {
            for j in 0..PROBES - 1 {
                let block = Area {
                    left: place(j, self.left, self.right),
                    top: place(i, self.top, self.bottom),
                    right: place(j + 1, self.left, self.right),
                    bottom: place(i + 1, self.top, self.bottom),
                };
                let corners = [probes[i][j], probes[i][j + 1], probes[i + 1][j], probes[i + 1][j + 1]];
                match uniform(corners.iter()) {
                    Uniform::Nothing => {}
                    Uniform::Surface(_) => block.interpolate(exposure.width, &corners, light),
                    Uniform::No => block.render_each(exposure, tile, light),
                }
            }
        }
    }

    fn interpolate(&self, width: usize, corners: &[Option<Hit>; 4], light: &mut [f32]) {
        let [a, b, c, d] = corners.map(|hit| hit.map_or(0.0, |hit| hit.light));
        let (w, h) = ((self.right - self.left) as f32, (self.bottom - self.top) as f32);
        for row in self.top..self.bottom {
            let y = ((row - self.top) as f32 + 0.5) / h;
            for column in self.left..self.right {
                let x = ((column - self.left) as f32 + 0.5) / w;
                light[row * width + column] = (a + (b - a) * x) * (1.0 - y) + (c + (d - c) * x) * y;
            }
        }
    }

    fn render_each(&self, exposure: &Exposure<'_>, tile: &Candidates, light: &mut [f32]) {
        for row in self.top..self.bottom {
            for column in self.left..self.right {
                let rays = exposure.rays.pixel(column, row);
                let pixel = &mut light[row * exposure.width + column];
                let behind = *pixel;
                *pixel = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]
                    .map(|(x, y)| {
                        exposure
                            .view
                            .trace(tile, rays.at(x, y), row, SLICES / 2, exposure.lamp)
                            .map_or(behind, |hit| hit.light)
                    })
                    .iter()
                    .sum::<f32>()
                    / 4.0;
            }
        }
    }
}

/// What a corner of a pixel shows during the exposure.
#[derive(Debug, Clone, Copy)]
struct Probe {
    /// As it begins, and as it ends.
    ends: [Option<Hit>; 2],
    /// Whether nothing else shows in between.
    steady: bool,
}

impl Default for Probe {
    fn default() -> Self {
        Self { ends: [None; 2], steady: true }
    }
}

impl Probe {
    fn new(pace: Pace, trace: impl Fn(usize) -> Option<Hit>) -> Self {
        let first = trace(0);
        match pace {
            Pace::Still => Self { ends: [first; 2], steady: true },
            Pace::Slow => Self { ends: [first, trace(SLICES - 1)], steady: true },
            Pace::Fast => {
                let key = first.map(|hit| hit.key);
                let steady = (1..SLICES - 1).all(|slice| trace(slice).map(|hit| hit.key) == key);
                Self { ends: [first, trace(SLICES - 1)], steady }
            }
        }
    }
}

/// Whether some probes agree.
enum Uniform {
    /// All miss.
    Nothing,
    /// All hit one surface of one ink; the mean of their light.
    Surface(f32),
    /// They differ.
    No,
}

fn uniform<'a>(hits: impl Iterator<Item = &'a Option<Hit>>) -> Uniform {
    let (mut key, mut sum, mut count) = (None, 0.0, 0.0);
    for hit in hits {
        let own = hit.map(|hit| hit.key);
        if count > 0.0 && own != key {
            return Uniform::No;
        }
        key = own;
        sum += hit.map_or(0.0, |hit| hit.light);
        count += 1.0;
    }
    if key.is_none() { Uniform::Nothing } else { Uniform::Surface(sum / count) }
}

/// The mean of 16 samples, one in each cell of a 4 x 4 grid, each at another slice of the exposure; or of several such
/// draws.
fn sampled(
    exposure: &Exposure<'_>,
    among: &Candidates,
    rays: &PixelRays,
    (column, row): (usize, usize),
    behind: f32,
) -> f32 {
    // Each column and each row of the grid sees all times evenly: a magic-square-like order.
    const ORDER: [usize; GRID * GRID] = [0, 10, 5, 15, 12, 6, 9, 3, 7, 13, 2, 8, 11, 1, 14, 4];
    let mut random = super::sensor::mix(exposure.seed ^ ((row as u64) << 32 | column as u64));
    let mut sum = 0.0;
    for _ in 0..exposure.draws {
        let turn = random as usize % SLICES;
        for (cell, order) in ORDER.iter().enumerate() {
            random = super::sensor::mix(random);
            let jitter = |bits: u64| (bits & 0xffff) as f32 / 65536.0;
            let x = ((cell % GRID) as f32 + jitter(random)) / GRID as f32;
            let y = ((cell / GRID) as f32 + jitter(random >> 16)) / GRID as f32;
            let slice = (order / (GRID * GRID / SLICES) + turn) % SLICES;
            let hit = exposure.view.trace(among, rays.at(x, y), row, slice, exposure.lamp);
            sum += hit.map_or(behind, |hit| hit.light);
        }
    }
    sum / (GRID * GRID * exposure.draws as usize) as f32
}
