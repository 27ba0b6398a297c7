//! Picks the pixels of a tag that say where its edges are.
//!
//! They lie where the grey level changes most: beside the edges, no farther than the blur reaches. As many are picked
//! of each tag, evenly along all its edges, so that reading a tag takes about the same time whatever its size.

use super::bend::Bend;
use super::fit::{Appearance, Pixels, Samples};
use super::pattern::{CELLS, Pattern};
use super::places::{self, Local, Places};
use super::rays::RayGrid;
use crate::image::GrayImage;
use crate::vector::{Kernel, LANES, Vector, fastest};

/// Not so close to the end of the white margin, cells: what lies beyond is unknown.
const BORDER: f32 = 0.35;

/// How many pixels to pick, and how far beside the edges.
#[derive(Debug, Clone, Copy)]
pub struct Choice {
    /// Every so many of the pattern's eights of spots.
    pub stride: usize,
    /// Share of the blur's half-width,
    pub blur_share: f64,
    /// and pixels more, for what is not known yet of where the edges are.
    pub spare_px: f64,
    /// How often each spot is used, each time at another distance from its edge.
    pub turns: usize,
}

/// Notes which pixels were picked, so that none counts twice.
#[derive(Debug, Default)]
pub struct Picked {
    /// A bit for each pixel of a rectangle, row by row.
    words: Vec<u64>,
    first: [f32; 2],
    columns: f32,
}

/// A tag in an image.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// The image.
    pub image: &'a GrayImage,
    /// The tag.
    pub pattern: &'a Pattern,
    /// Where its cells lie in the image, roughly.
    pub places: Places,
    /// Its local coordinates.
    pub local: Local,
    /// What a rolling shutter makes of them.
    pub bend: Bend,
    /// Rectangle of pixels that holds it: first and last.
    pub bounds_px: [[i32; 2]; 2],
    /// Length of the gradients of u and v in the image.
    pub cells_per_px: [f64; 2],
}

impl Picked {
    fn clear(&mut self, [first, last]: [[i32; 2]; 2]) {
        let [columns, rows] = [0, 1].map(|axis| (last[axis] - first[axis]).max(0) + 1);
        self.first = first.map(|number| number as f32);
        self.columns = columns as f32;
        self.words.clear();
        self.words.resize((columns * rows) as usize / 64 + 1, 0);
    }

    /// Where the bits of eight pixels are.
    #[inline(always)]
    fn places<V: Vector>(&self, x: V, y: V) -> [i32; LANES] {
        let (first_x, first_y) = (V::splat(self.first[0]), V::splat(self.first[1]));
        (y - first_y).times_plus(V::splat(self.columns), x - first_x).whole()
    }

    /// Whether a pixel is picked for the first time; `false` beyond the rectangle.
    #[inline(always)]
    fn first_time(&mut self, place: i32) -> bool {
        let bit = 1 << (place & 63);
        match self.words.get_mut(place as usize / 64) {
            Some(word) => {
                let new = *word & bit == 0;
                *word |= bit;
                new
            }
            None => false,
        }
    }
}

/// Picks pixels.
pub fn pick(
    scene: &Scene<'_>,
    rays: &RayGrid,
    appearance: &Appearance,
    choice: &Choice,
    picked: &mut Picked,
    samples: &mut Samples,
) {
    picked.clear(scene.bounds_px);
    samples.clear();
    fastest(Picking { scene, rays, appearance, choice, picked, samples });
}

struct Picking<'a> {
    scene: &'a Scene<'a>,
    rays: &'a RayGrid,
    appearance: &'a Appearance,
    choice: &'a Choice,
    picked: &'a mut Picked,
    samples: &'a mut Samples,
}

impl Kernel for Picking<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector>(self) {
        let Self { scene, rays, appearance, choice, picked, samples } = self;
        let moved = appearance.smear_cells().map(|cells| 0.5 * cells);
        let reach: [f32; 2] = std::array::from_fn(|axis| {
            let blur = choice.blur_share * appearance.blur_cells[axis];
            (blur + choice.spare_px * scene.cells_per_px[axis] + moved[axis]) as f32
        });
        let border = moved.map(|cells| BORDER + cells as f32);
        let (reach_u, reach_v) = (V::splat(reach[0]), V::splat(reach[1]));
        let cells_from_local = appearance.cells_from_local.map(|value| value as f32);
        let inv_unit = V::splat((1.0 / scene.local.unit) as f32);
        let origin_x = V::splat(scene.local.origin.x as f32);
        let origin_y = V::splat(scene.local.origin.y as f32);
        let end = CELLS as f32 - BORDER;
        let image = scene.image;
        // Whole numbers up to 16 million are exact.
        let width = V::splat(image.width() as f32);
        let turns = (0..choice.turns).map(|turn| turn as f32 / choice.turns as f32);
        let all = turns.flat_map(|turn| scene.pattern.spots(choice.stride).map(move |spots| (turn, spots)));
        for (turn, spots) in all {
            // From −1 to 1, and on from −1.
            let share = V::new(spots.aside) + V::splat(turn);
            let aside = (share - share.floor()).times_plus(V::splat(2.0), V::splat(-1.0));
            let u = (aside * reach_u).times_plus(V::new(spots.normal_u), V::new(spots.u));
            let v = (aside * reach_v).times_plus(V::new(spots.normal_v), V::new(spots.v));
            let [x, y] = scene.places.pixels(u, v);
            let (x, y) = (places::nearest(x, image.width()), places::nearest(y, image.height()));
            let (places, bits) = (y.times_plus(width, x).whole(), picked.places(x, y));
            let mut pixels = Pixels::default();
            for lane in 0..LANES {
                pixels.grey[lane] = f32::from(image.data()[places[lane] as usize]);
                pixels.weight[lane] = f32::from(u8::from(picked.first_time(bits[lane])));
            }
            let [ray_x, ray_y] = rays.at(x, y);
            let (x, y) = ((ray_x - origin_x) * inv_unit, (ray_y - origin_y) * inv_unit);
            let (x, y) = scene.bend.straightened(x, y);
            let (u, v) = places::mapped(&cells_from_local, x, y);
            let between = |place: V, border: f32| place.is_between(border, CELLS as f32 - border);
            let inside = between(u, border[0]) * between(v, border[1]);
            pixels.weight = (V::new(pixels.weight) * inside).to_array();
            let (column, row) = (u.bounded(BORDER, end).floor(), v.bounded(BORDER, end).floor());
            let cells = row.times_plus(V::splat(CELLS as f32), column).whole();
            pixels.x = x.to_array();
            pixels.y = y.to_array();
            pixels.column = column.to_array();
            pixels.row = row.to_array();
            for lane in 0..LANES {
                pixels.around[lane] = i32::from(scene.pattern.around(cells[lane] as usize));
            }
            samples.push(pixels);
        }
    }
}
